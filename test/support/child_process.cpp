#include "camvox/test/child_process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

#include "camvox/test/deadline.hpp"

namespace camvox::test {
namespace {

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> all;
  for (auto& text : texts) all.push_back(text.data());
  all.push_back(nullptr);
  return all;
}

std::vector<std::string> merged_environment(const std::map<std::string, std::string>& more) {
  std::vector<std::string> all;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string text = *variable;
    if (!more.contains(text.substr(0, text.find('=')))) all.push_back(text);
  }
  for (const auto& [name, value] : more) all.push_back(name + "=" + value);
  return all;
}

struct Pipe {
  Pipe() {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("pipe");
    read = ends[0];
    write = ends[1];
  }
  int read;
  int write;
};

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& command,
                           const std::map<std::string, std::string>& environment) {
  signal(SIGPIPE, SIG_IGN);  // `tell` to a program that ended
  const Pipe output;
  const Pipe input;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input.read, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output.write, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output.write, STDERR_FILENO);
  auto arguments = command;
  auto variables = merged_environment(environment);
  const int failed = posix_spawnp(&pid_,
                                  command.at(0).c_str(),
                                  &actions,
                                  nullptr,
                                  pointers(arguments).data(),
                                  pointers(variables).data());
  posix_spawn_file_actions_destroy(&actions);
  close(output.write);
  close(input.read);
  output_pipe_ = output.read;
  input_pipe_ = input.write;
  if (failed != 0) throw std::runtime_error("cannot start " + command.at(0));
  reader_ = std::thread([this] { read_output(); });
}

ChildProcess::~ChildProcess() {
  kill_hard();
  reader_.join();
  close(output_pipe_);
  close(input_pipe_);
}

void ChildProcess::read_output() {
  std::array<char, 4096> buffer{};
  for (;;) {
    const auto size = read(output_pipe_, buffer.data(), buffer.size());
    const std::lock_guard lock(mutex_);
    output_ended_ = size <= 0;
    if (output_ended_) return;
    output_.append(buffer.data(), static_cast<std::size_t>(size));
  }
}

std::string ChildProcess::output() const {
  const std::lock_guard lock(mutex_);
  return output_;
}

bool ChildProcess::output_ended() const {
  const std::lock_guard lock(mutex_);
  return output_ended_;
}

bool ChildProcess::wrote(const std::string& text, std::chrono::milliseconds patience) const {
  const auto there = [&] { return output().find(text) != std::string::npos; };
  return wait_until([&] { return there() || output_ended(); }, patience) && there();
}

void ChildProcess::tell(const std::string& line) {
  const std::string text = line + "\n";
  if (write(input_pipe_, text.data(), text.size()) < 0) throw std::runtime_error("child is gone");
}

int ChildProcess::wait(std::chrono::milliseconds patience) {
  (void)wait_until(
      [&] {
        int status = 0;
        if (result_ != kRunsOn || waitpid(pid_, &status, WNOHANG) != pid_) {
          return result_ != kRunsOn;
        }
        result_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
        return true;
      },
      patience);
  // What it wrote last may still be in the pipe; a grandchild may keep that open for longer.
  if (result_ != kRunsOn) {
    (void)wait_until([this] { return output_ended(); }, std::chrono::seconds(2));
  }
  return result_;
}

void ChildProcess::kill_hard() {
  if (result_ == kRunsOn) kill(pid_, SIGKILL);
  (void)wait();
}

}  // namespace camvox::test
