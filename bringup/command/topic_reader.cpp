#include "topic_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace camvox::command {
namespace {

constexpr std::chrono::milliseconds kEndTimeout{1000};
constexpr int kQueue = 100;  // a short stall of the terminal must not count as loss

/// Demands of the publishers only what all of them offer, so that all of them match.
Qos matching_qos(const TopicInfo& topic) {
  const auto all = [&topic](auto member) {
    return std::all_of(topic.publishers.begin(), topic.publishers.end(), member);
  };
  return {kQueue,
          all([](const auto& publisher) { return publisher.reliable; }),
          all([](const auto& publisher) { return publisher.latched; })};
}

}  // namespace

std::vector<TopicInfo> topics_of(const Session::Endpoints& endpoints) {
  std::map<std::string, TopicInfo> topics;
  for (const auto& endpoint : endpoints) {
    if (!endpoint.topic_name.starts_with("rt/")) continue;
    const auto name = endpoint.topic_name.substr(2);
    auto& topic = topics[name];
    topic.name = name;
    topic.type_name = interfaces::to_ros_type_name(endpoint.type_name);
    (endpoint.is_writer ? topic.publishers : topic.subscribers).push_back(endpoint);
  }
  std::vector<TopicInfo> sorted;
  for (auto& [name, topic] : topics) sorted.push_back(std::move(topic));
  return sorted;
}

void require_topic_name(const std::string& name) {
  const auto problem = topics::name_problem(name);
  if (!problem.empty()) throw CommandError(problem);
}

TopicInfo find_published_topic(const Session& session, const std::string& name) {
  require_topic_name(name);
  TopicInfo found;
  const bool published = session.look_for([&](const Session::Endpoints& endpoints) {
    for (auto& topic : topics_of(endpoints)) {
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

TopicReader::TopicReader(const Session& session, const TopicInfo& topic, OnMessage on_message)
    : executor_(std::make_shared<dds::Executor>("topic")) {
  dds::Middleware middleware;
  middleware.participant = session.participant();
  context_ = std::make_unique<dds::ComponentContext>(
      dds::ComponentSettings{"command", {}, {}},
      middleware,
      executor_,
      std::make_shared<bringup::ConsoleLogger>("camvox", LogLevel::kWarn),
      [this](std::exception_ptr error) {
        error_ = std::move(error);
        done();
      });
  SubscribeOptions options;
  options.qos = matching_qos(topic);
  context_->subscribe_raw({"topic", topic.name}, topic.type_name, std::move(on_message), options);
}

TopicReader::~TopicReader() { context_->deactivate(kEndTimeout); }

void TopicReader::every(std::chrono::nanoseconds period, std::function<void()> callback) {
  context_->every(period, std::move(callback));
}

void TopicReader::run() {
  executor_->start();
  context_->activate();
  stop_.wait();
  context_->deactivate(kEndTimeout);
  executor_->stop(kEndTimeout);
  if (error_ != nullptr) std::rethrow_exception(error_);
}

}  // namespace camvox::command
