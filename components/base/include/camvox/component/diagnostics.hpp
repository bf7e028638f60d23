#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

namespace camvox {

/// Levels of diagnostic_msgs/DiagnosticStatus.
enum class HealthLevel : std::uint8_t { kOk = 0, kWarn = 1, kError = 2, kStale = 3 };

/// What a component says of its own health; the container publishes it on /diagnostics once a
/// second. Safe to use from any thread.
class Diagnostics {
 public:
  struct Status {
    HealthLevel level = HealthLevel::kOk;
    std::string message = "ok";
    std::map<std::string, std::string, std::less<>> values;
  };

  void report(HealthLevel level, std::string_view message);
  void set(std::string_view key, std::string_view value);
  void set(std::string_view key, double value);
  void set(std::string_view key, std::uint64_t value);
  [[nodiscard]] Status status() const;

 private:
  mutable std::mutex mutex_;
  Status status_;
};

}  // namespace camvox
