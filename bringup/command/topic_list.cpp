#include <fmt/format.h>

#include "topic.hpp"
#include "topic_reader.hpp"

namespace camvox::command {
namespace {

dds::TopicEndpoints find_topic(const Session& session, const std::string& name) {
  require_topic_name(name);
  for (auto& topic : dds::topics_of(session.settled())) {
    if (topic.name == name) return topic;
  }
  throw CommandError(
      fmt::format("there is no topic {} on {}; 'camvox topic list' shows what there "
                  "is",
                  name,
                  session.domain_text()));
}

void print_endpoint(const dds::DiscoveredEndpoint& endpoint, const std::string& type_name) {
  fmt::print("\nParticipant: {}\nTopic type: {}\nEndpoint type: {}\nGID: {}\nQoS profile:\n",
             endpoint.participant_name,
             type_name,
             endpoint.is_writer ? "PUBLISHER" : "SUBSCRIPTION",
             endpoint.guid);
  fmt::print("  Reliability: {}\n  Durability: {}\n",
             endpoint.reliable ? "RELIABLE" : "BEST_EFFORT",
             endpoint.latched ? "TRANSIENT_LOCAL" : "VOLATILE");
}

}  // namespace

int topic_list(const CommonOptions& common, const TopicOptions& options) {
  const Session session(common);
  auto topics = dds::topics_of(session.settled());
  if (!options.hidden) {
    std::erase_if(topics,
                  [](const auto& topic) { return topic.name.find("/_") != std::string::npos; });
  }
  if (topics.empty()) throw CommandError("there are no topics on " + session.domain_text());
  if (options.count_only) {
    fmt::print("{}\n", topics.size());
    return Exit::kDone;
  }
  for (const auto& topic : topics) {
    fmt::print("{}{}\n", topic.name, options.show_types ? " [" + topic.type_name + "]" : "");
  }
  return Exit::kDone;
}

int topic_info(const CommonOptions& common, const TopicOptions& options) {
  const Session session(common);
  const auto topic = find_topic(session, options.topic);
  fmt::print("Type: {}\n", topic.type_name);
  fmt::print("Publisher count: {}\n", topic.publishers.size());
  if (options.verbose) {
    for (const auto& endpoint : topic.publishers) print_endpoint(endpoint, topic.type_name);
    fmt::print("\n");
  }
  fmt::print("Subscription count: {}\n", topic.subscribers.size());
  if (options.verbose) {
    for (const auto& endpoint : topic.subscribers) print_endpoint(endpoint, topic.type_name);
  }
  return Exit::kDone;
}

int topic_type(const CommonOptions& common, const TopicOptions& options) {
  const Session session(common);
  fmt::print("{}\n", find_topic(session, options.topic).type_name);
  return Exit::kDone;
}

}  // namespace camvox::command
