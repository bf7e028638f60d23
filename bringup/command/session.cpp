#include "session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <thread>

namespace camvox::command {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kPollPeriod = 10ms;
constexpr auto kQuietTime = 400ms;  // longer than discovery pauses within one participant

dds::ParticipantOptions participant_options(const CommonOptions& options) {
  dds::ParticipantOptions participant;
  participant.name = "camvox_command";
  participant = dds::with_ros_environment(participant);
  participant.domain_id = options.domain_id;  // has the environment as its default already
  if (options.subnet) participant.network = dds::Network::kSubnet;
  return participant;
}

}  // namespace

Session::Session(const CommonOptions& options)
    : log_(std::make_shared<bringup::ConsoleLogger>("camvox", LogLevel::kWarn)),
      timeout_(static_cast<std::int64_t>(1e3 * options.timeout_s)),
      participant_(dds::Participant::create(participant_options(options), *log_)) {}

std::string Session::domain_text() const {
  return fmt::format("domain {}", participant_->options().domain_id);
}

bool Session::look_for(const std::function<bool(const Endpoints&)>& found) const {
  const auto deadline = Clock::now() + timeout_;
  while (!found(participant_->discovered_endpoints())) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(kPollPeriod);
  }
  return true;
}

Session::Endpoints Session::settled() const {
  std::size_t known = 0;
  auto changed = Clock::now();
  look_for([&](const Endpoints& endpoints) {
    if (endpoints.size() != known) {
      known = endpoints.size();
      changed = Clock::now();
    }
    return known > 0 && Clock::now() - changed > kQuietTime;
  });
  return participant_->discovered_endpoints();
}

std::vector<std::string> Session::owners_of(const std::string& suffix,
                                            const Endpoints& endpoints) const {
  std::set<std::string> owners;
  const std::string ending = suffix + "Request";
  for (const auto& endpoint : endpoints) {
    const std::string& topic = endpoint.topic_name;
    if (endpoint.is_writer || !topic.starts_with("rq/") || !topic.ends_with(ending)) continue;
    owners.insert(topic.substr(2, topic.size() - 2 - ending.size()));
  }
  return {owners.begin(), owners.end()};
}

void Session::require_service(const std::string& service) const {
  const std::string topic = "rq" + service + "Request";
  const bool served = look_for([&topic](const Endpoints& endpoints) {
    return std::any_of(endpoints.begin(), endpoints.end(), [&topic](const auto& endpoint) {
      return !endpoint.is_writer && endpoint.topic_name == topic;
    });
  });
  if (!served) {
    throw CommandError(
        fmt::format("nobody serves {} on {}; does the container run?", service, domain_text()));
  }
}

void Session::no_answer(const std::string& service) const {
  throw CommandError(service + " did not answer; the container may hang");
}

std::string with_slash(const std::string& name) {
  return name.starts_with('/') ? name : "/" + name;
}

}  // namespace camvox::command
