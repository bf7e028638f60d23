#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numbers>
#include <random>

#include "camvox/calibration/calibrator.hpp"
#include "simulated_stop.hpp"

// Prints the table of what calibration reaches in the synthetic world:
//   bench_calibration [starts per scene = 20] [edges|camvox] [degrees = 5] [first scene] [scenes]
namespace camvox {
namespace {

using geometry::SE3;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kSeconds = 4;

const std::vector<test::Stop> kStops = {{"plaza", 1, -22, -9, 0.35},
                                        {"plaza", 1, 18, -12, 1.57},
                                        {"plaza", 2, 18, 10, 3.1},
                                        {"plaza", 3, -18, 10, -1.2},
                                        {"campus", 1, 10, -1.2, 0.0},
                                        {"campus", 1, 70, -1.2, 0.2},
                                        {"campus", 2, 20, -1.2, 0.0},
                                        {"campus", 3, 1.2, 30, 1.57},
                                        {"street", 1, 10, -1.2, 0.0},
                                        {"street", 2, 40, -1.2, 0.0},
                                        {"corridor", 1, 6, 0, 0.0},
                                        {"corridor", 2, 20, 0, 3.1}};

double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// A start off by up to `max_deg` about any axis, and by up to 10 cm.
SE3 random_start(std::mt19937& generator, double max_deg) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const auto direction = [&] {
    return Eigen::Vector3d(normal(generator), normal(generator), normal(generator)).normalized();
  };
  const Eigen::Vector3d turn = direction() * (uniform(generator) * max_deg * kDegree);
  const Eigen::Vector3d shift = direction() * (uniform(generator) * 0.1);
  const SE3 truth = test::true_T_camera_lidar();
  return {geometry::SO3::exp(turn) * truth.rotation(), truth.translation() + shift};
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// Results of one scene, or of all.
struct Tally {
  std::vector<double> rotation_deg;
  std::vector<double> translation_m;
  std::vector<double> seconds;
  std::vector<double> sigma_deg;
  std::vector<double> cost_before;
  std::vector<double> cost_after;
  int bad_accepted = 0;  ///< Worse than 0.2 degrees, yet applied.
  int good_refused = 0;  ///< Within 0.1 degrees, yet refused.

  void add(const Tally& other) {
    const auto append = [](auto& to, const auto& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    append(rotation_deg, other.rotation_deg);
    append(translation_m, other.translation_m);
    append(seconds, other.seconds);
    append(sigma_deg, other.sigma_deg);
    append(cost_before, other.cost_before);
    append(cost_after, other.cost_after);
    bad_accepted += other.bad_accepted;
    good_refused += other.good_refused;
  }
  void print(const std::string& name, double cost_truth) const {
    const auto good = std::count_if(
        rotation_deg.begin(), rotation_deg.end(), [](double error) { return error <= 0.1; });
    std::printf(
        "| %s | %ld/%zu | %.3f | %.3f | %.1f | %.1f | %.3f | %d | %d | %.2f | %.2f | %.2f / %.2f / "
        "%.2f |\n",
        name.c_str(),
        static_cast<long>(good),
        rotation_deg.size(),
        quantile(rotation_deg, 0.5),
        quantile(rotation_deg, 1.0),
        100.0 * quantile(translation_m, 0.5),
        100.0 * quantile(translation_m, 1.0),
        quantile(sigma_deg, 0.5),
        bad_accepted,
        good_refused,
        quantile(seconds, 0.5),
        quantile(seconds, 1.0),
        quantile(cost_before, 0.5),
        quantile(cost_after, 0.5),
        cost_truth);
    std::fflush(stdout);
  }
};

void count(const calibration::CalibrationResult& result, double seconds, Tally& tally) {
  const SE3 truth = test::true_T_camera_lidar();
  const double error_deg =
      (truth.rotation().inverse() * result.T_camera_lidar.rotation()).angle_rad() / kDegree;
  tally.rotation_deg.push_back(error_deg);
  tally.translation_m.push_back((result.T_camera_lidar.translation() - truth.translation()).norm());
  tally.seconds.push_back(seconds);
  tally.sigma_deg.push_back(result.sigma_rotation_deg);
  tally.cost_before.push_back(result.camvox_cost_before);
  tally.cost_after.push_back(result.camvox_cost_after);
  if (result.accepted && error_deg > 0.2) ++tally.bad_accepted;
  if (!result.accepted && error_deg <= 0.1) ++tally.good_refused;
  if (!result.accepted) {
    std::fprintf(stderr, "error %.3f deg refused: %s\n", error_deg, result.reason.c_str());
  }
}

int run(
    int starts, const std::string& method, double max_deg, std::size_t first, std::size_t last) {
  std::puts(
      "| scene | within 0.1 deg | median deg | max deg | median cm | max cm | sigma deg | bad "
      "accepted | good refused | CPU s median | max | CamVox cost start / result / truth |");
  std::puts("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
  calibration::CalibrationConfig config;
  config.method = method;
  Tally all;
  for (std::size_t i = first; i < last; ++i) {
    const test::Stop& stop = kStops[i];
    const auto scene = test::look_from(stop, kSeconds);
    const calibration::CamvoxCost cost(
        scene, sensors::CameraModel(sensors::CameraIntrinsics{}), config.camvox);
    std::mt19937 generator(static_cast<unsigned>(100 + i));
    Tally tally;
    for (int k = 0; k < starts; ++k) {
      const SE3 start = random_start(generator, max_deg);
      const double begin = thread_seconds();
      const auto result = calibration::calibrate({scene}, {}, start, config);
      count(result, thread_seconds() - begin, tally);
    }
    tally.print(stop.world + " " + std::to_string(i), cost(test::true_T_camera_lidar()));
    all.add(tally);
  }
  all.print("all", 0.0);
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::printf("\nmethod %s, starts up to %.1f deg and 10 cm; peak memory %ld MB\n",
              method.c_str(),
              max_deg,
              usage.ru_maxrss / 1024);
  return 0;
}

}  // namespace
}  // namespace camvox

int main(int argc, char** argv) {
  const auto argument = [&](int i, const char* fallback) { return argc > i ? argv[i] : fallback; };
  const auto first = static_cast<std::size_t>(std::atoi(argument(4, "0")));
  const auto count = static_cast<std::size_t>(std::atoi(argument(5, "99")));
  return camvox::run(std::atoi(argument(1, "20")),
                     argument(2, "edges"),
                     std::atof(argument(3, "5")),
                     first,
                     std::min(first + count, camvox::kStops.size()));
}
