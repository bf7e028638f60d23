#include "camvox/bringup/console_logger.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

namespace camvox::bringup {
namespace {

constexpr LogLevel kLevels[] = {
    LogLevel::kDebug, LogLevel::kInfo, LogLevel::kWarn, LogLevel::kError, LogLevel::kFatal};

std::string upper_case(std::string_view text) {
  std::string upper(text);
  std::transform(upper.begin(), upper.end(), upper.begin(), [](unsigned char c) {
    return static_cast<char>(std::toupper(c));
  });
  return upper;
}

}  // namespace

void ConsoleLogger::write(LogLevel level, std::string_view text) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
  const std::string line = fmt::format("[{}] [{}.{:09}] [{}]: {}\n",
                                       upper_case(to_string(level)),
                                       ns / 1'000'000'000,
                                       ns % 1'000'000'000,
                                       name_,
                                       text);
  // One write a line: lines of several threads do not mix. A full pipe loses lines, not data.
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, line.data(), line.size());
}

LoggerFactory console_loggers(LogLevel least) {
  return [least](const std::string& name) { return std::make_shared<ConsoleLogger>(name, least); };
}

LogLevel parse_log_level(std::string_view name) {
  for (const auto level : kLevels) {
    if (to_string(level) == name) return level;
  }
  throw std::invalid_argument("there is no log level '" + std::string(name) +
                              "' (debug, info, warn, error, fatal)");
}

}  // namespace camvox::bringup
