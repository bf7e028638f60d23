#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "command.hpp"

namespace camvox::command {

void add_version(CLI::App& app, Action& action) {
  app.add_subcommand("version", "Print the version")->callback([&action] {
    action = [] {
      fmt::print("camvox {}\n", CAMVOX_VERSION);
      return Exit::kDone;
    };
  });
}

}  // namespace camvox::command
