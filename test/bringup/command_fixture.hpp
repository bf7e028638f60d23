#pragma once

#include <gmock/gmock.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "camvox/test/child_process.hpp"
#include "camvox/test/dds_domain.hpp"
#include "camvox/test/deadline.hpp"

namespace camvox::bringup {

/// Runs the camvox command as a user does, on a domain of its own.
class CommandFixture : public ::testing::Test {
 protected:
  struct Result {
    int exit_code;
    std::string output;  ///< Standard output and error.
  };

  [[nodiscard]] std::unique_ptr<test::ChildProcess> begin(
      std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), CAMVOX_COMMAND);
    return std::make_unique<test::ChildProcess>(
        arguments,
        std::map<std::string, std::string>{{"ROS_DOMAIN_ID", std::to_string(test::own_domain())}});
  }
  [[nodiscard]] Result command(const std::vector<std::string>& arguments) const {
    const auto process = begin(arguments);
    const int code = process->wait();
    return {code, process->output()};
  }
  /// Starts `camvox run` and waits until the container is up.
  void run(const std::string& config, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"run", write("rig.yaml", config)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    container_ = begin(arguments);
    ASSERT_TRUE(container_->wrote("components on domain")) << container_->output();
  }
  [[nodiscard]] int stop(int signal = SIGINT) const {
    kill(container_->pid(), signal);
    return container_->wait();
  }
  static std::string write(const std::string& name, const std::string& text) {
    const auto path =
        std::filesystem::path(::testing::TempDir()) / (std::to_string(getpid()) + "_" + name);
    std::ofstream(path) << text;
    return path;
  }

  std::unique_ptr<test::ChildProcess> container_;
};

}  // namespace camvox::bringup
