#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "command.hpp"
#include "signals.hpp"

namespace {

using camvox::command::Exit;

int fail(int code, const std::string& message) {
  fmt::print(stderr, "camvox: {}\n", message);
  return code;
}

/// What is wrong with the command line. A word that is none comes before what it seems to lack.
std::string usage_problem(const CLI::App& app, const CLI::ParseError& error) {
  const auto unknown = app.remaining(true);
  if (dynamic_cast<const CLI::RequiredError*>(&error) == nullptr || unknown.empty())
    return error.what();
  return fmt::format("unknown: {}", fmt::join(unknown, " "));
}

void add_common(CLI::App& app, camvox::command::CommonOptions& common) {
  app.add_option(
         "--domain", common.domain_id, "DDS domain to talk to (default: $ROS_DOMAIN_ID or 0)")
      ->envname("ROS_DOMAIN_ID")
      ->check(CLI::Range(0, 232));
  app.add_flag("--subnet", common.subnet, "Look beyond this machine");
  app.add_option(
         "--timeout", common.timeout_s, "How long to look for what is asked for, in s (default: 2)")
      ->check(CLI::Range(0.0, 3600.0));
}

}  // namespace

int main(int argc, char** argv) {
  camvox::command::block_stop_signals();  // before any thread is made
  camvox::command::CommonOptions common;
  camvox::command::Action action;
  CLI::App app("Lidar-assisted visual SLAM: runs component containers and looks into them.",
               "camvox");
  app.require_subcommand(1);
  app.fallthrough();
  add_common(app, common);
  camvox::command::add_run(app, action);
  camvox::command::add_component(app, common, action);
  camvox::command::add_topic(app, common, action);
  camvox::command::add_param(app, common, action);
  camvox::command::add_bag(app, common, action);
  camvox::command::add_calibrate(app, action);
  camvox::command::add_evaluate(app, action);
  camvox::command::add_import(app, action);
  camvox::command::add_inspect(app, action);
  camvox::command::add_report(app, action);
  camvox::command::add_simulate(app, action);
  camvox::command::add_version(app, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    return app.exit(success);  // --help
  } catch (const CLI::ParseError& error) {
    return fail(Exit::kBadUsage, usage_problem(app, error) + " (--help lists what there is)");
  }
  try {
    return action();
  } catch (const std::exception& error) {
    return fail(Exit::kFailed, error.what());
  }
}
