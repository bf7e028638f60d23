#pragma once

#include <string>
#include <vector>

#include "bench_case.hpp"
#include "camvox/calibration/calibrator.hpp"

namespace camvox::bench {

/// What counts as good (share of successes, refusals) and as bad (applied although wrong).
struct Limits {
  double good_deg = 0.1;
  double bad_deg = 0.2;
};

/// The value below which a share of the values lies; 0 without values.
[[nodiscard]] double quantile(std::vector<double> values, double share);

/// Results of one case, or of all.
class Tally {
 public:
  explicit Tally(Limits limits) : limits_(limits) {}

  void add(const BenchCase& bench_case,
           const calibration::CalibrationResult& result,
           double seconds);
  void add(const Tally& other);

  /// Markdown: one line for the table whose head print_head prints.
  void print(const std::string& name) const;
  static void print_head(Limits limits);
  /// The counterpart of the paper's table: its cost at the start, the result and the truth.
  void print_costs(const std::string& name, double cost_truth) const;

 private:
  Limits limits_;
  std::vector<double> rotation_deg_;
  std::vector<double> observed_m_;  ///< Error along each axis that is known to 2 cm.
  std::vector<double> normalised_;  ///< Squared errors over their covariance, per dimension.
  std::vector<double> seconds_;
  std::vector<double> sigma_deg_;
  std::vector<double> cost_before_;
  std::vector<double> cost_after_;
  int bad_applied_ = 0;
  int good_refused_ = 0;
};

}  // namespace camvox::bench
