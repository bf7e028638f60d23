#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <string>

#include "camvox/dds/executor.hpp"

namespace camvox::bringup {

/// The threads of a container: one for each component, or one for those that share it by name.
class ExecutorPool {
 public:
  /// The executor that components name in their config.
  [[nodiscard]] std::shared_ptr<dds::Executor> shared(const std::string& name) {
    auto& executor = shared_[name];
    if (executor == nullptr) executor = make(name);
    return executor;
  }
  [[nodiscard]] static std::shared_ptr<dds::Executor> make(const std::string& name) {
    auto executor = std::make_shared<dds::Executor>(name);
    executor->start();
    return executor;
  }
  void clear() { shared_.clear(); }

 private:
  std::map<std::string, std::shared_ptr<dds::Executor>> shared_;
};

}  // namespace camvox::bringup
