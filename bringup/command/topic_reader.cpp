#include "topic_reader.hpp"

#include <fmt/format.h>

namespace camvox::command {
namespace {

constexpr int kQueue = 100;  // a short stall of the terminal must not count as loss

}  // namespace

void require_topic_name(const std::string& name) {
  const auto problem = topics::name_problem(name);
  if (!problem.empty()) throw CommandError(problem);
}

dds::TopicEndpoints find_published_topic(const Session& session, const std::string& name) {
  require_topic_name(name);
  dds::TopicEndpoints found;
  const bool published = session.look_for([&](const Session::Endpoints& endpoints) {
    for (auto& topic : dds::topics_of(endpoints)) {
      if (topic.name == name && !topic.publishers.empty()) found = std::move(topic);
    }
    return !found.publishers.empty();
  });
  if (!published) {
    throw CommandError(
        fmt::format("nobody publishes {} on {}; 'camvox topic list' shows what "
                    "there is",
                    name,
                    session.domain_text()));
  }
  return found;
}

TopicReader::TopicReader(const Session& session,
                         const dds::TopicEndpoints& topic,
                         OnMessage on_message)
    : component_(session, "camvox", {}, LogLevel::kWarn) {
  SubscribeOptions options;
  options.qos = dds::describe(topic).offered;
  options.qos.depth = kQueue;
  component_.context().subscribe_raw(
      {"topic", topic.name}, topic.type_name, std::move(on_message), options);
}

void TopicReader::every(std::chrono::nanoseconds period, std::function<void()> callback) {
  component_.context().every(period, std::move(callback));
}

void TopicReader::run() {
  component_.activate([] {});
  component_.stop_signal().wait();
  component_.finish();
}

}  // namespace camvox::command
