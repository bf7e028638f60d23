#include "container_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "command.hpp"
#include "signals.hpp"

namespace camvox::command {
namespace {

using namespace std::chrono_literals;
using namespace camvox::bringup;

constexpr auto kStopTimeout = 1300ms;   // for components to end, of the 2 s that a stop may take
constexpr auto kStopPatience = 1800ms;  // for everything

/// 0, or kUnclean if a component is not as it should be.
int final_state(const std::vector<ComponentInfo>& components) {
  const bool fine = std::all_of(components.begin(), components.end(), [](const auto& component) {
    return component.state == ComponentState::kRunning;
  });
  return fine ? Exit::kDone : Exit::kUnclean;
}

}  // namespace

std::filesystem::path find_config(const std::string& name) {
  if (std::filesystem::exists(name)) return name;
  std::error_code ignored;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
  const auto installed = program.parent_path().parent_path() / "share/camvox_bringup/config" / name;
  return std::filesystem::is_regular_file(installed, ignored) ? installed
                                                              : std::filesystem::path(name);
}

void refuse(const std::vector<Problem>& problems) {
  for (const auto& problem : problems) fmt::print(stderr, "{}\n", problem.to_string());
  throw CommandError(fmt::format("{} problem{} in the config; nothing was started",
                                 problems.size(),
                                 problems.size() == 1 ? "" : "s"));
}

int run_container(CheckedConfig checked,
                  std::shared_ptr<PluginLoader> plugins,
                  const LoggerFactory& loggers) {
  const auto log = loggers(checked.config.container.name);
  const auto save_timeout = std::chrono::milliseconds(
      static_cast<std::int64_t>(1e3 * checked.config.container.save_timeout_s));
  auto container = std::make_unique<Container>(
      std::move(checked.config), std::move(checked.probed), std::move(plugins), loggers);
  ExitGuard guard(
      kStopPatience,
      [&container, log] {
        log->error("does not end: still {}; exits without it", container->current_activity());
      },
      [log](const char* what) { log->info("{}", what); });
  container->on_exit_request([&guard] { guard.request(); });
  container->start();
  guard.wait();
  log->info("stops");
  guard.extend(kStopPatience + save_timeout);  // results may be under way already
  int code = final_state(container->components());
  const auto hung = container->stop(
      kStopTimeout, [&guard, save_timeout] { guard.extend(kStopPatience + save_timeout); });
  if (!hung.empty()) {
    log->error(
        "exits without {}, which hang{}", fmt::join(hung, ", "), hung.size() == 1 ? "s" : "");
    std::_Exit(Exit::kUnclean);  // their threads still use what destructors would take away
  }
  if (!container->all_saved()) code = Exit::kUnclean;
  log->info("stopped");
  return code;
}

}  // namespace camvox::command
