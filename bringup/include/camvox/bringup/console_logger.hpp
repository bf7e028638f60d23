#pragma once

#include <functional>
#include <memory>
#include <string>

#include "camvox/component/logger.hpp"

namespace camvox::bringup {

/// Writes "[INFO] [1763791234.123456789] [sync]: text" to standard error, a line at a time, with
/// the name in the place where ROS 2 puts it. Thread-safe.
class ConsoleLogger final : public Logger {
 public:
  ConsoleLogger(std::string name, LogLevel least) : name_(std::move(name)), least_(least) {}
  void write(LogLevel level, std::string_view text) override;
  [[nodiscard]] bool enabled(LogLevel level) const override { return level >= least_; }

 private:
  std::string name_;
  LogLevel least_;
};

/// Makes the logger of a component by its name; tests put in one that records.
using LoggerFactory = std::function<std::shared_ptr<Logger>(const std::string& name)>;

[[nodiscard]] LoggerFactory console_loggers(LogLevel least);

/// "debug", "info", "warn", "error" or "fatal"; throws std::invalid_argument for others.
[[nodiscard]] LogLevel parse_log_level(std::string_view name);

}  // namespace camvox::bringup
