#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "camvox/dds/executor.hpp"
#include "endpoints.hpp"

namespace camvox::dds {

/// Carries internal topics across the border of this process, so that components only ever see
/// in-place samples.
///
/// A topic produced here is *exported*: while somebody outside reads it, its messages are sent as
/// the ROS 2 message of the same name, with only the used part of their lists. A topic that is
/// subscribed but not produced here is *imported*: read once, straight into a loaned in-place
/// sample, whatever the number of subscribers. Serialising happens on the gateway's own thread.
class Gateway : public std::enable_shared_from_this<Gateway> {
 public:
  Gateway(std::shared_ptr<Participant> participant, std::shared_ptr<Logger> log);
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;
  ~Gateway();

  /// Tells that the topic is produced, or subscribed, in this container for as long as the
  /// returned handle lives.
  [[nodiscard]] std::shared_ptr<void> add_producer(const std::string& topic,
                                                   const MessageType& type,
                                                   const Qos& qos);
  [[nodiscard]] std::shared_ptr<void> add_consumer(const std::string& topic,
                                                   const MessageType& type,
                                                   const Qos& qos);
  /// Tells that the topic is read from memory shared with another process; see `may_produce`.
  [[nodiscard]] std::shared_ptr<void> add_shared_consumer(const std::string& topic,
                                                          const MessageType& type,
                                                          const Qos& qos);
  [[nodiscard]] bool is_produced(const std::string& topic);
  /// False while this container reads the topic from another process' shared memory: Fast DDS
  /// cannot share memory inside a process and would stall the topic.
  [[nodiscard]] bool may_produce(const std::string& topic);
  /// What was lost or rejected of a topic's messages before they became in-place samples.
  [[nodiscard]] std::shared_ptr<const AtomicStats> border_stats(const std::string& topic);
  /// What was lost of a topic's messages on their way out to other processes, all of which miss it.
  [[nodiscard]] std::shared_ptr<const AtomicStats> export_stats(const std::string& topic);

 private:
  class Export;
  class Import;
  struct Entry {
    const MessageType* type = nullptr;
    Qos qos;
    int producers = 0;
    int consumers = 0;
    int shared_consumers = 0;
    std::shared_ptr<AtomicStats> border_stats = std::make_shared<AtomicStats>();
    std::shared_ptr<AtomicStats> export_stats = std::make_shared<AtomicStats>();
    std::shared_ptr<Export> outgoing;
    std::shared_ptr<Import> incoming;
  };

  [[nodiscard]] std::shared_ptr<void> add(const std::string& topic,
                                          const MessageType& type,
                                          const Qos& qos,
                                          int Entry::*role);
  void update(const std::string& topic);

  std::shared_ptr<Participant> participant_;
  std::shared_ptr<Logger> log_;
  std::shared_ptr<Executor> executor_;
  std::mutex mutex_;
  std::map<std::string, Entry> entries_;
};

}  // namespace camvox::dds
