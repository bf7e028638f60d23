#pragma once

#include <functional>
#include <memory>
#include <string>

#include "camvox/dds/component_context.hpp"
#include "session.hpp"
#include "signals.hpp"

namespace camvox::command {

/// What discovery tells of one topic.
struct TopicInfo {
  std::string name;       ///< "/tf"
  std::string type_name;  ///< "tf2_msgs/msg/TFMessage"
  Session::Endpoints publishers;
  Session::Endpoints subscribers;
};

/// All ROS topics among the endpoints, sorted by name.
[[nodiscard]] std::vector<TopicInfo> topics_of(const Session::Endpoints& endpoints);

/// The topic, as soon as somebody publishes it; throws CommandError if nobody does.
[[nodiscard]] TopicInfo find_published_topic(const Session& session, const std::string& name);

/// Reads a topic of any type as serialised messages, on a thread of its own.
class TopicReader {
 public:
  using OnMessage = std::function<void(const Sample<RawMessage>&)>;

  TopicReader(const Session& session, const TopicInfo& topic, OnMessage on_message);
  TopicReader(const TopicReader&) = delete;
  TopicReader& operator=(const TopicReader&) = delete;
  ~TopicReader();

  /// Calls back on the reader's thread.
  void every(std::chrono::nanoseconds period, std::function<void()> callback);
  /// Reads until Ctrl-C or `done()`; then no callback runs any more. Throws what a callback threw.
  void run();
  void done() { stop_.request(); }

 private:
  StopSignal stop_;
  std::exception_ptr error_;
  std::shared_ptr<dds::Executor> executor_;
  std::unique_ptr<dds::ComponentContext> context_;
};

/// Throws CommandError for a name that no topic can have.
void require_topic_name(const std::string& name);

}  // namespace camvox::command
