#include "single_component.hpp"

namespace camvox::command {
namespace {

constexpr std::chrono::milliseconds kEndTimeout{1000};

}  // namespace

SingleComponent::SingleComponent(const Session& session,
                                 const std::string& name,
                                 config::ParameterMap parameters,
                                 LogLevel log_level)
    : executor_(std::make_shared<dds::Executor>(name)) {
  dds::Middleware middleware;
  middleware.participant = session.participant();
  context_ = std::make_unique<dds::ComponentContext>(
      dds::ComponentSettings{name, std::move(parameters), {}},
      middleware,
      executor_,
      std::make_shared<bringup::ConsoleLogger>(name, log_level),
      [this](std::exception_ptr error) {
        error_ = std::move(error);
        stop_.request();
      });
}

SingleComponent::~SingleComponent() {
  context_->deactivate(kEndTimeout);
  executor_->stop(kEndTimeout);
}

void SingleComponent::activate(std::function<void()> start) {
  context_->activate();
  context_->post(std::move(start));
  executor_->start();
}

void SingleComponent::finish() {
  context_->deactivate(kEndTimeout);
  executor_->stop(kEndTimeout);
  if (error_) std::rethrow_exception(error_);
}

config::Parameter from_command_line(config::Value value) {
  return {std::move(value), {"command line", 0}};
}

}  // namespace camvox::command
