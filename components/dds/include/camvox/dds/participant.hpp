#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "camvox/component/logger.hpp"

namespace eprosima::fastdds::dds {
class DomainParticipant;
class Publisher;
class Subscriber;
class Topic;
class TopicDataType;
}  // namespace eprosima::fastdds::dds

namespace camvox::dds {

/// Who may talk to this process over DDS.
enum class Network {
  kLocalhost,  ///< Only processes of this machine: unicast on loopback, shared memory.
  kSubnet,     ///< Multicast discovery on all interfaces, as ROS 2 does by default.
};

struct ParticipantOptions {
  std::string name = "camvox";
  int domain_id = 0;
  Network network = Network::kLocalhost;
  bool shared_memory = true;  ///< Use shared memory towards other processes of this machine.
  bool udp = true;            ///< Send messages over UDP. Discovery goes over UDP in any case.
  std::size_t shared_memory_segment_bytes = std::size_t{64} << 20;
  std::vector<std::string> peers;  ///< More hosts to look for (IPv4), with kSubnet.
};

/// Applies ROS_DOMAIN_ID, ROS_LOCALHOST_ONLY, ROS_AUTOMATIC_DISCOVERY_RANGE and ROS_STATIC_PEERS
/// where they are set. Throws std::runtime_error naming a variable with an impossible value.
[[nodiscard]] ParticipantOptions with_ros_environment(ParticipantOptions options);

/// A reader or writer on the domain.
struct DiscoveredEndpoint {
  std::string topic_name;  ///< As on the wire, e.g. "rt/tf".
  std::string type_name;   ///< As on the wire, e.g. "tf2_msgs::msg::dds_::TFMessage_".
  std::string guid;        ///< Identifies the endpoint.
  bool is_writer = false;
  bool reliable = false;
  bool latched = false;
  std::string participant_name;
};

/// This process on a DDS domain: one participant, its topics, and what discovery found.
/// Thread-safe. Endpoints keep it alive; it is deleted after the last of them.
class Participant {
 public:
  /// Throws std::runtime_error that says what is missing, e.g. how much /dev/shm is needed.
  static std::shared_ptr<Participant> create(const ParticipantOptions& options, Logger& log);
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;
  ~Participant();

  [[nodiscard]] const ParticipantOptions& options() const { return options_; }
  /// Names topics that must not match outside of this process; unique in the domain.
  [[nodiscard]] const std::string& unique_token() const;
  /// Endpoints of other participants, in the order of their GUIDs.
  [[nodiscard]] std::vector<DiscoveredEndpoint> discovered_endpoints() const;
  /// Endpoints of this participant.
  [[nodiscard]] std::vector<DiscoveredEndpoint> own_endpoints() const;
  void add_own_endpoint(DiscoveredEndpoint endpoint);
  void remove_own_endpoint(const std::string& guid);

  [[nodiscard]] eprosima::fastdds::dds::DomainParticipant* get() const;
  [[nodiscard]] eprosima::fastdds::dds::Publisher* publisher() const;
  [[nodiscard]] eprosima::fastdds::dds::Subscriber* subscriber() const;

  /// The DDS topic of that name, created when first asked for; released with the last copy of the
  /// pointer. Takes the topic type over. Throws if the name is in use with another type.
  [[nodiscard]] std::shared_ptr<eprosima::fastdds::dds::Topic> topic(
      const std::string& name, eprosima::fastdds::dds::TopicDataType* type);

 private:
  struct Implementation;
  Participant(ParticipantOptions options, Logger& log);

  ParticipantOptions options_;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace camvox::dds
