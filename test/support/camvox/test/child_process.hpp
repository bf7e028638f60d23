#pragma once

#include <sys/types.h>

#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace camvox::test {

/// Another program under the control of a test; killed at the latest when this goes.
class ChildProcess {
 public:
  /// Starts a program with these arguments and, on top of this process', environment variables.
  explicit ChildProcess(const std::vector<std::string>& command,
                        const std::map<std::string, std::string>& environment = {});
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();

  /// All that the program has written so far, errors included.
  [[nodiscard]] std::string output() const;
  /// Waits until it has written this text; false when it ended, or took too long, without.
  [[nodiscard]] bool wrote(const std::string& text,
                           std::chrono::milliseconds patience = std::chrono::seconds(30)) const;
  /// Writes a line to its standard input.
  void tell(const std::string& line);
  /// Waits for its end: the exit code, minus the signal that ended it, or kRunsOn.
  [[nodiscard]] int wait(std::chrono::milliseconds patience = std::chrono::seconds(30));
  /// kill -9, and waits for the end.
  void kill_hard();
  [[nodiscard]] pid_t pid() const { return pid_; }

  static constexpr int kRunsOn = -1000;

 private:
  void read_output();
  [[nodiscard]] bool output_ended() const;

  pid_t pid_ = -1;
  int output_pipe_ = -1;
  int input_pipe_ = -1;
  int result_ = kRunsOn;
  mutable std::mutex mutex_;
  std::string output_;
  bool output_ended_ = false;
  std::thread reader_;
};

}  // namespace camvox::test
