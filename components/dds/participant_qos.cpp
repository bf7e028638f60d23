#include "participant_qos.hpp"

#include <fastdds/rtps/transport/TransportInterface.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fmt/format.h>

#include <cstdlib>
#include <memory>
#include <random>
#include <stdexcept>

#include "camvox/dds/shared_memory.hpp"

namespace camvox::dds {
namespace {

namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;

constexpr std::uint32_t kShmMaxMessageBytes = 4 << 20;
constexpr std::uint32_t kSocketBufferBytes = 4 << 20;
constexpr std::size_t kShmPortBytes = std::size_t{2} << 20;  // ports, locks and other small files
constexpr std::uint32_t kFirstOwnShmPort = 1U << 30;         // far above the ports of any domain
constexpr int kLocalPeers = 32;  // processes on this machine that find each other without multicast

/// RTPS 2.3, 9.6.1.1: metatraffic unicast port of the n-th participant of a domain.
std::uint32_t metatraffic_port(int domain_id, int participant_index) {
  return static_cast<std::uint32_t>(7400 + 250 * domain_id + 10 + 2 * participant_index);
}

/// RTPS 2.3, 9.6.1.1: metatraffic multicast port of a domain.
std::uint32_t multicast_port(int domain_id) {
  return static_cast<std::uint32_t>(7400 + 250 * domain_id);
}

Locator_t udp_locator(const std::string& address, std::uint32_t port) {
  Locator_t locator;
  locator.kind = LOCATOR_KIND_UDPv4;
  IPLocator::setIPv4(locator, address);
  locator.port = port;
  return locator;
}

/// Fast DDS chooses the port, and the addresses unless the machine's loopback is asked for.
Locator_t any_port(bool loopback) { return udp_locator(loopback ? "127.0.0.1" : "0.0.0.0", 0); }

std::string mebibytes(std::uint64_t bytes) { return fmt::format("{} MiB", bytes >> 20); }

void require_shared_memory(const ParticipantOptions& options) {
  const std::uint64_t needed = options.shared_memory_segment_bytes + kShmPortBytes;
  const std::uint64_t free = free_shared_memory_bytes();
  if (free >= needed) return;
  throw std::runtime_error(fmt::format(
      "shared memory: /dev/shm has {} free, this container needs {}. Enlarge it (mount -o "
      "remount,size=..., docker run --shm-size=...), lower container.shared_memory_segment_mb, or "
      "leave it out with container.transports: [udp]",
      mebibytes(free),
      mebibytes(needed)));
}

void add_transports(eprosima::fastdds::dds::DomainParticipantQos& qos,
                    const ParticipantOptions& options) {
  qos.transport().use_builtin_transports = false;
  auto udp = std::make_shared<rtps::UDPv4TransportDescriptor>();
  udp->sendBufferSize = kSocketBufferBytes;
  udp->receiveBufferSize = kSocketBufferBytes;
  if (options.network == Network::kLocalhost) udp->interfaceWhiteList = {"127.0.0.1"};
  qos.transport().user_transports.push_back(udp);
  if (options.shared_memory) {
    require_shared_memory(options);
    auto shm = std::make_shared<rtps::SharedMemTransportDescriptor>();
    shm->segment_size(static_cast<std::uint32_t>(options.shared_memory_segment_bytes));
    shm->max_message_size(kShmMaxMessageBytes);
    qos.transport().user_transports.push_back(shm);
  }
}

/// Where user data are received. Fast DDS derives the shared-memory port from the participant's
/// index, so a process that replaces a killed one gets the killed one's port; a peer that still has
/// that mapped writes into the void until its 512 places are full, and a reliable topic between the
/// two may never recover. Hence a port of our own.
void add_user_locators(eprosima::fastdds::dds::DomainParticipantQos& qos,
                       const ParticipantOptions& options) {
  auto& locators = qos.wire_protocol().default_unicast_locator_list;
  // The address of such a locator carries the host's number, which only the transport knows.
  const std::unique_ptr<rtps::TransportInterface> shm(
      rtps::SharedMemTransportDescriptor().create_transport());
  shm->getDefaultUnicastLocators(locators,
                                 kFirstOwnShmPort + std::random_device()() % kFirstOwnShmPort);
  if (!options.udp) return;
  locators.push_back(any_port(options.network == Network::kLocalhost));
}

/// Discovery goes over UDP alone, also where shared memory is on: see add_user_locators for what
/// a process that replaces a killed one would inherit.
void add_discovery(eprosima::fastdds::dds::DomainParticipantQos& qos,
                   const ParticipantOptions& options) {
  auto& builtin = qos.wire_protocol().builtin;
  const bool local = options.network == Network::kLocalhost;
  builtin.metatrafficUnicastLocatorList.push_back(any_port(local));
  const auto multicast = udp_locator("239.255.0.1", multicast_port(options.domain_id));
  if (!local) builtin.metatrafficMulticastLocatorList.push_back(multicast);
  const auto hosts = local ? std::vector<std::string>{"127.0.0.1"} : options.peers;
  for (const auto& host : hosts) {
    for (int i = 0; i < kLocalPeers; ++i) {
      builtin.initialPeersList.push_back(udp_locator(host, metatraffic_port(options.domain_id, i)));
    }
  }
  if (!local && !hosts.empty()) builtin.initialPeersList.push_back(multicast);
}

int parse_domain_id(const char* text) {
  char* end = nullptr;
  const long value = std::strtol(text, &end, 10);
  if (end == text || *end != '\0' || value < 0 || value > 232) {
    throw std::runtime_error(
        fmt::format("ROS_DOMAIN_ID='{}': must be an integer from 0 to 232", text));
  }
  return static_cast<int>(value);
}

Network parse_discovery_range(const std::string& text, Network otherwise) {
  if (text == "SUBNET") return Network::kSubnet;
  if (text == "LOCALHOST" || text == "OFF") return Network::kLocalhost;
  if (text == "SYSTEM_DEFAULT") return otherwise;
  throw std::runtime_error(fmt::format(
      "ROS_AUTOMATIC_DISCOVERY_RANGE='{}': must be SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT",
      text));
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::string part;
  for (const char c : text + separator) {
    if (c != separator) {
      part += c;
    } else if (!part.empty()) {
      parts.push_back(std::exchange(part, {}));
    }
  }
  return parts;
}

}  // namespace

ParticipantOptions with_ros_environment(ParticipantOptions options) {
  const auto variable = [](const char* name) -> const char* {
    const char* value = std::getenv(name);
    return value != nullptr && *value != '\0' ? value : nullptr;
  };
  if (const char* id = variable("ROS_DOMAIN_ID")) options.domain_id = parse_domain_id(id);
  if (const char* range = variable("ROS_AUTOMATIC_DISCOVERY_RANGE")) {
    options.network = parse_discovery_range(range, options.network);
  }
  if (const char* only = variable("ROS_LOCALHOST_ONLY"); only != nullptr && *only == '1') {
    options.network = Network::kLocalhost;
  }
  if (const char* peers = variable("ROS_STATIC_PEERS")) options.peers = split(peers, ';');
  return options;
}

eprosima::fastdds::dds::DomainParticipantQos participant_qos(ParticipantOptions options) {
  if (!options.udp && !options.shared_memory) {
    throw std::runtime_error(
        "container.transports: at least one of shared_memory and udp is needed");
  }
  // Discovery over shared memory does not survive a killed process in Fast DDS 2.9.1, so it always
  // goes over UDP: this machine's loopback where user data are to take shared memory only.
  if (!options.udp) options.network = Network::kLocalhost;
  eprosima::fastdds::dds::DomainParticipantQos qos;
  qos.name(options.name);
  const std::string enclave = "enclave=/;";
  qos.user_data().assign(enclave.begin(), enclave.end());
  // A killed process is noticed after the lease; a stalled one must not be.
  qos.wire_protocol().builtin.discovery_config.leaseDuration = {5, 0};
  qos.wire_protocol().builtin.discovery_config.leaseDuration_announcementperiod = {1, 0};
  add_transports(qos, options);
  if (options.shared_memory) add_user_locators(qos, options);
  add_discovery(qos, options);
  return qos;
}

}  // namespace camvox::dds
