#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

namespace camvox {

/// Severities of rcl_interfaces/Log.
enum class LogLevel { kDebug = 10, kInfo = 20, kWarn = 30, kError = 40, kFatal = 50 };

/// Where a component writes its log: `log.warn("{} points over capacity", count)`.
class Logger {
 public:
  Logger() = default;
  Logger(const Logger&) = delete;
  Logger& operator=(const Logger&) = delete;
  virtual ~Logger() = default;

  virtual void write(LogLevel level, std::string_view text) = 0;
  [[nodiscard]] virtual bool enabled(LogLevel level) const = 0;

  template <typename... Args>
  void debug(fmt::format_string<Args...> text, Args&&... args) {
    log(LogLevel::kDebug, text, std::forward<Args>(args)...);
  }
  template <typename... Args>
  void info(fmt::format_string<Args...> text, Args&&... args) {
    log(LogLevel::kInfo, text, std::forward<Args>(args)...);
  }
  template <typename... Args>
  void warn(fmt::format_string<Args...> text, Args&&... args) {
    log(LogLevel::kWarn, text, std::forward<Args>(args)...);
  }
  template <typename... Args>
  void error(fmt::format_string<Args...> text, Args&&... args) {
    log(LogLevel::kError, text, std::forward<Args>(args)...);
  }

 private:
  template <typename... Args>
  void log(LogLevel level, fmt::format_string<Args...> text, Args&&... args) {
    if (enabled(level)) write(level, fmt::format(text, std::forward<Args>(args)...));
  }
};

/// "debug", "info", "warn", "error", "fatal".
[[nodiscard]] std::string_view to_string(LogLevel level);

}  // namespace camvox
