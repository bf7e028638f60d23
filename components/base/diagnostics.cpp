#include "camvox/component/diagnostics.hpp"

#include <fmt/format.h>

namespace camvox {

void Diagnostics::report(HealthLevel level, std::string_view message) {
  const std::lock_guard lock(mutex_);
  status_.level = level;
  status_.message = message;
}

void Diagnostics::set(std::string_view key, std::string_view value) {
  const std::lock_guard lock(mutex_);
  status_.values.insert_or_assign(std::string(key), std::string(value));
}

void Diagnostics::set(std::string_view key, double value) { set(key, fmt::format("{:g}", value)); }

void Diagnostics::set(std::string_view key, std::uint64_t value) {
  set(key, fmt::format("{}", value));
}

Diagnostics::Status Diagnostics::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

}  // namespace camvox
