#pragma once

#include <functional>
#include <memory>
#include <string>

#include "camvox/dds/component_context.hpp"
#include "session.hpp"
#include "signals.hpp"

namespace camvox::command {

/// One component on a participant and a thread of its own, for commands that publish or read topics
/// until Ctrl-C. An exception that leaves a callback ends the wait and is thrown by `finish`.
class SingleComponent {
 public:
  SingleComponent(const Session& session,
                  const std::string& name,
                  config::ParameterMap parameters,
                  LogLevel log_level = LogLevel::kInfo);
  SingleComponent(const SingleComponent&) = delete;
  SingleComponent& operator=(const SingleComponent&) = delete;
  ~SingleComponent();

  [[nodiscard]] Context& context() { return *context_; }
  [[nodiscard]] StopSignal& stop_signal() { return stop_; }
  /// Starts delivery and runs `start` on the component's thread.
  void activate(std::function<void()> start);
  /// Ends delivery; then nothing of the component runs any more.
  void finish();

 private:
  StopSignal stop_;
  std::exception_ptr error_;
  std::shared_ptr<dds::Executor> executor_;
  std::unique_ptr<dds::ComponentContext> context_;
};

/// A parameter map entry with the command line as its origin.
[[nodiscard]] config::Parameter from_command_line(config::Value value);

}  // namespace camvox::command
