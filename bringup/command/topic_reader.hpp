#pragma once

#include <functional>
#include <string>

#include "single_component.hpp"

namespace camvox::command {

/// The topic, as soon as somebody publishes it; throws CommandError if nobody does.
[[nodiscard]] dds::TopicEndpoints find_published_topic(const Session& session,
                                                       const std::string& name);

/// Reads a topic of any type as serialised messages, on a thread of its own.
class TopicReader {
 public:
  using OnMessage = std::function<void(const Sample<RawMessage>&)>;

  TopicReader(const Session& session, const dds::TopicEndpoints& topic, OnMessage on_message);

  /// Calls back on the reader's thread.
  void every(std::chrono::nanoseconds period, std::function<void()> callback);
  /// Reads until Ctrl-C or `done()`; then no callback runs any more. Throws what a callback threw.
  void run();
  void done() { component_.stop_signal().request(); }

 private:
  SingleComponent component_;
};

/// Throws CommandError for a name that no topic can have.
void require_topic_name(const std::string& name);

}  // namespace camvox::command
