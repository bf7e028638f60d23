#pragma once

#include <functional>
#include <stdexcept>
#include <string>

namespace CLI {
class App;
}

/// What the command groups of `camvox` have in common. Each group adds its words to the parser; a
/// word that was chosen leaves its action, which main runs.
namespace camvox::command {

/// An expected failure: printed on standard error, exit code 1.
class CommandError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Exit codes of the command.
enum Exit : int {
  kDone = 0,
  kFailed = 1,    ///< What was asked for could not be done.
  kBadUsage = 2,  ///< The command line is wrong.
  kUnclean = 3,   ///< `run`: a component had failed or hung when the container ended.
  kInterrupted = 130,
};

/// Options that every command takes.
struct CommonOptions {
  int domain_id = 0;
  bool subnet = false;
  double timeout_s = 2.0;
};

using Action = std::function<int()>;

void add_run(CLI::App& app, Action& action);
void add_component(CLI::App& app, const CommonOptions& common, Action& action);
void add_topic(CLI::App& app, const CommonOptions& common, Action& action);
void add_param(CLI::App& app, const CommonOptions& common, Action& action);
void add_bag(CLI::App& app, const CommonOptions& common, Action& action);
void add_calibrate(CLI::App& app, Action& action);
void add_evaluate(CLI::App& app, Action& action);
void add_import(CLI::App& app, Action& action);
void add_inspect(CLI::App& app, Action& action);
void add_report(CLI::App& app, Action& action);
void add_simulate(CLI::App& app, Action& action);
void add_version(CLI::App& app, Action& action);

}  // namespace camvox::command
