#include "camvox/dds/participant.hpp"

#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <map>
#include <mutex>
#include <sstream>
#include <stdexcept>

#include "camvox/interfaces/message_type.hpp"
#include "participant_qos.hpp"

namespace camvox::dds {
namespace {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

template <typename Guid>
std::string to_text(const Guid& guid) {
  std::ostringstream text;
  text << guid;
  return text.str();
}

/// Remembers every endpoint and participant that discovery reports.
class DiscoveryListener final : public fdds::DomainParticipantListener {
 public:
  explicit DiscoveryListener(Logger& log) : log_(log) {}
  void on_participant_discovery(fdds::DomainParticipant*,
                                rtps::ParticipantDiscoveryInfo&& info) override {
    using Info = rtps::ParticipantDiscoveryInfo;
    const auto prefix = to_text(info.info.m_guid.guidPrefix);
    const auto name = info.info.m_participantName.to_string();
    const bool gone =
        info.status == Info::REMOVED_PARTICIPANT || info.status == Info::DROPPED_PARTICIPANT;
    const std::lock_guard lock(mutex_);
    const bool is_news =
        gone ? names_.erase(prefix) > 0 : names_.insert_or_assign(prefix, name).second;
    if (is_news) log_.debug("process {} ({}) {}", name, prefix, gone ? "has gone" : "is there");
  }
  void on_subscriber_discovery(fdds::DomainParticipant*,
                               rtps::ReaderDiscoveryInfo&& info) override {
    const bool gone = info.status == rtps::ReaderDiscoveryInfo::REMOVED_READER;
    update(info.info, gone, false);
  }
  void on_publisher_discovery(fdds::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) override {
    const bool gone = info.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER;
    update(info.info, gone, true);
  }

  [[nodiscard]] std::vector<DiscoveredEndpoint> endpoints() const {
    const std::lock_guard lock(mutex_);
    std::vector<DiscoveredEndpoint> all;
    for (const auto& [guid, found] : endpoints_) {
      all.push_back(found.endpoint);
      if (const auto name = names_.find(found.prefix); name != names_.end()) {
        all.back().participant_name = name->second;
      }
    }
    return all;
  }

 private:
  struct Found {
    DiscoveredEndpoint endpoint;
    std::string prefix;
  };

  template <typename ProxyData>
  void update(const ProxyData& data, bool gone, bool is_writer) {
    const std::string guid = to_text(data.guid());
    const std::lock_guard lock(mutex_);
    if (gone) {
      endpoints_.erase(guid);
      return;
    }
    Found found;
    found.endpoint.topic_name = data.topicName().to_string();
    found.endpoint.type_name = data.typeName().to_string();
    found.endpoint.guid = guid;
    found.endpoint.is_writer = is_writer;
    found.endpoint.reliable = data.m_qos.m_reliability.kind == fdds::RELIABLE_RELIABILITY_QOS;
    found.endpoint.latched = data.m_qos.m_durability.kind != fdds::VOLATILE_DURABILITY_QOS;
    found.prefix = to_text(data.guid().guidPrefix);
    endpoints_[guid] = std::move(found);
  }

  Logger& log_;
  mutable std::mutex mutex_;
  std::map<std::string, Found> endpoints_;
  std::map<std::string, std::string> names_;
};

/// Sends what Fast DDS itself has to say to our log instead of standard output.
class LogConsumer final : public fdds::LogConsumer {
 public:
  explicit LogConsumer(Logger& log) : log_(log) {}
  void Consume(const fdds::Log::Entry& entry) override {
    // The library calls "error" what we handle and report with more context; keep it findable.
    log_.debug("fastdds {}: {}", entry.context.category, entry.message);
  }

 private:
  Logger& log_;
};

}  // namespace

struct Participant::Implementation {
  explicit Implementation(Logger& log) : listener(log) {}

  struct TopicUse {
    fdds::Topic* topic = nullptr;
    std::string type_name;
    int users = 0;
  };

  DiscoveryListener listener;
  fdds::DomainParticipant* participant = nullptr;
  fdds::Publisher* publisher = nullptr;
  fdds::Subscriber* subscriber = nullptr;
  std::string token;
  std::mutex topics_mutex;
  std::map<std::string, TopicUse> topics;
  std::mutex own_mutex;
  std::map<std::string, DiscoveredEndpoint> own;

  void release(const std::string& name) {
    const std::lock_guard lock(topics_mutex);
    const auto use = topics.find(name);
    if (--use->second.users > 0) return;
    participant->delete_topic(use->second.topic);
    topics.erase(use);
  }
};

std::shared_ptr<Participant> Participant::create(const ParticipantOptions& options, Logger& log) {
  return std::shared_ptr<Participant>(new Participant(options, log));
}

Participant::Participant(ParticipantOptions options, Logger& log)
    : options_(std::move(options)), implementation_(std::make_unique<Implementation>(log)) {
  fdds::Log::ClearConsumers();
  fdds::Log::RegisterConsumer(std::make_unique<LogConsumer>(log));
  auto& self = *implementation_;
  self.participant = fdds::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<std::uint32_t>(options_.domain_id),
      participant_qos(options_),
      &self.listener,
      fdds::StatusMask::none());
  if (self.participant == nullptr) {
    throw std::runtime_error("DDS could not join domain " + std::to_string(options_.domain_id) +
                             ": are its UDP ports free, is loopback up?");
  }
  self.publisher = self.participant->create_publisher(fdds::PUBLISHER_QOS_DEFAULT);
  self.subscriber = self.participant->create_subscriber(fdds::SUBSCRIBER_QOS_DEFAULT);
  for (const char c : to_text(self.participant->guid().guidPrefix)) {
    if (c != '.') self.token += c;
  }
}

Participant::~Participant() {
  auto& self = *implementation_;
  self.participant->delete_publisher(self.publisher);
  self.participant->delete_subscriber(self.subscriber);
  fdds::DomainParticipantFactory::get_instance()->delete_participant(self.participant);
  fdds::Log::ClearConsumers();  // the logger may not outlive us
}

const std::string& Participant::unique_token() const { return implementation_->token; }

std::vector<DiscoveredEndpoint> Participant::discovered_endpoints() const {
  return implementation_->listener.endpoints();
}

std::vector<DiscoveredEndpoint> Participant::own_endpoints() const {
  const std::lock_guard lock(implementation_->own_mutex);
  std::vector<DiscoveredEndpoint> all;
  for (const auto& [guid, endpoint] : implementation_->own) all.push_back(endpoint);
  return all;
}

void Participant::add_own_endpoint(DiscoveredEndpoint endpoint) {
  endpoint.participant_name = options_.name;
  const std::lock_guard lock(implementation_->own_mutex);
  implementation_->own[endpoint.guid] = std::move(endpoint);
}

void Participant::remove_own_endpoint(const std::string& guid) {
  const std::lock_guard lock(implementation_->own_mutex);
  implementation_->own.erase(guid);
}

fdds::DomainParticipant* Participant::get() const { return implementation_->participant; }
fdds::Publisher* Participant::publisher() const { return implementation_->publisher; }
fdds::Subscriber* Participant::subscriber() const { return implementation_->subscriber; }

std::shared_ptr<fdds::Topic> Participant::topic(const std::string& name,
                                                fdds::TopicDataType* type) {
  auto& self = *implementation_;
  fdds::TypeSupport support(type);
  const std::string type_name = support.get_type_name();
  const std::lock_guard lock(self.topics_mutex);
  auto& use = self.topics[name];
  if (use.users == 0) {
    if (self.participant->find_type(type_name).empty()) support.register_type(self.participant);
    use.topic = self.participant->create_topic(name, type_name, fdds::TOPIC_QOS_DEFAULT);
    use.type_name = type_name;
  } else if (use.type_name != type_name) {
    throw std::runtime_error("topic " + name + " has type " +
                             interfaces::to_ros_type_name(use.type_name) + ", not " +
                             interfaces::to_ros_type_name(type_name));
  }
  if (use.topic == nullptr) {
    self.topics.erase(name);
    throw std::runtime_error("DDS refused the topic " + name);
  }
  ++use.users;
  return {use.topic, [&self, name](fdds::Topic*) { self.release(name); }};
}

}  // namespace camvox::dds
