#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "camvox/dds/component_context.hpp"

namespace camvox::test {

/// Keeps what is logged.
class MemoryLogger final : public Logger {
 public:
  void write(LogLevel level, std::string_view text) override;
  [[nodiscard]] bool enabled(LogLevel) const override { return true; }
  [[nodiscard]] std::string text() const;

 private:
  mutable std::mutex mutex_;
  std::string text_;
};

/// Participant options of a test: own domain, this machine only.
[[nodiscard]] dds::ParticipantOptions test_options(std::string name = "test");

/// A container without config and plugins: component contexts over real DDS, each on a thread of
/// its own, torn down in the right order. What leaves a callback is kept in `errors`.
class TestContainer {
 public:
  explicit TestContainer(const dds::ParticipantOptions& options = test_options(),
                         dds::TopicSettingsMap topics = {});
  TestContainer(const TestContainer&) = delete;
  TestContainer& operator=(const TestContainer&) = delete;
  ~TestContainer();

  /// A new component; wire it, then `activate`.
  dds::ComponentContext& component(const std::string& name = "component");
  /// Starts delivery to every component that has been made.
  void activate();
  /// Ends and destroys one component.
  void remove(dds::ComponentContext& component);

  [[nodiscard]] MemoryLogger& log() { return *log_; }
  [[nodiscard]] const dds::Middleware& middleware() const { return middleware_; }
  [[nodiscard]] std::vector<std::string> errors() const;

 private:
  struct Member {
    std::shared_ptr<dds::Executor> executor;
    std::unique_ptr<dds::ComponentContext> context;
    bool active = false;
  };
  void end(Member& member);

  std::shared_ptr<MemoryLogger> log_ = std::make_shared<MemoryLogger>();
  dds::Middleware middleware_;
  std::deque<Member> members_;
  mutable std::mutex errors_mutex_;
  std::vector<std::string> errors_;
};

}  // namespace camvox::test
