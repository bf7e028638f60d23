#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

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
  [[nodiscard]] std::shared_ptr<dds::Executor> make(const std::string& name) {
    auto executor = std::make_shared<dds::Executor>(name);
    executor->start();
    made_->add(executor);
    return executor;
  }
  /// Tells whether none of the threads has anything left to do; from any thread.
  [[nodiscard]] std::function<bool()> idle_query() const {
    return [made = made_] { return dds::all_idle(made->living()); };
  }
  void clear() { shared_.clear(); }

 private:
  class Made {
   public:
    void add(const std::shared_ptr<dds::Executor>& executor) {
      const std::lock_guard lock(mutex_);
      std::erase_if(executors_, [](const auto& made) { return made.expired(); });
      executors_.push_back(executor);
    }
    [[nodiscard]] std::vector<std::shared_ptr<dds::Executor>> living() const {
      const std::lock_guard lock(mutex_);
      std::vector<std::shared_ptr<dds::Executor>> living;
      for (const auto& made : executors_) {
        if (auto executor = made.lock()) living.push_back(std::move(executor));
      }
      return living;
    }

   private:
    mutable std::mutex mutex_;
    std::vector<std::weak_ptr<dds::Executor>> executors_;
  };

  std::map<std::string, std::shared_ptr<dds::Executor>> shared_;
  std::shared_ptr<Made> made_ = std::make_shared<Made>();
};

}  // namespace camvox::bringup
