#pragma once

#include <fastdds/rtps/common/WriteParams.h>

#include <atomic>
#include <chrono>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "camvox/component/context.hpp"
#include "camvox/dds/component_context.hpp"
#include "camvox/dds/participant.hpp"

/// Thin owners of DDS endpoints, and the QoS that measuring showed to be right.
namespace camvox::dds {

/// In-place samples of one container. The pool of a topic is the sum of what its endpoints ask
/// for: a writer its queue and loans, a reader its queue, what it holds, and one to spare. With
/// this sizing the writer never waits and nothing is ever overwritten while somebody reads it.
[[nodiscard]] eprosima::fastdds::dds::DataWriterQos in_place_writer_qos(const Qos& qos, int loans);
[[nodiscard]] eprosima::fastdds::dds::DataReaderQos in_place_reader_qos(const Qos& qos, int held);

/// Samples in memory shared with other processes. Lossless within the writer's blocking bound;
/// needs KEEP_ALL and more extra samples than any reader holds.
inline constexpr int kSharedExtraSamples = 8;
inline constexpr int kSharedMaxHeld = kSharedExtraSamples - 2;
[[nodiscard]] eprosima::fastdds::dds::DataWriterQos shared_writer_qos(
    const Qos& qos, std::chrono::milliseconds max_blocking);
[[nodiscard]] eprosima::fastdds::dds::DataReaderQos shared_reader_qos(const Qos& qos, int held);

/// Serialised messages, as ROS 2 has them. Published from the middleware's own thread, so that a
/// slow network never holds up a component.
[[nodiscard]] eprosima::fastdds::dds::DataWriterQos wire_writer_qos(const Qos& qos);
[[nodiscard]] eprosima::fastdds::dds::DataReaderQos wire_reader_qos(const Qos& qos);

/// A data writer with its topic; counts the readers that it matches.
class WriterHandle : private eprosima::fastdds::dds::DataWriterListener {
 public:
  WriterHandle(std::shared_ptr<Participant> participant,
               const std::string& topic_name,
               eprosima::fastdds::dds::TopicDataType* type,
               const eprosima::fastdds::dds::DataWriterQos& qos,
               std::function<void()> on_match_change = {});
  ~WriterHandle() override;

  eprosima::fastdds::dds::DataWriter* operator->() const { return writer_; }
  [[nodiscard]] std::size_t reader_count() const { return readers_; }
  [[nodiscard]] bool matches(const eprosima::fastrtps::rtps::GUID_t& reader) const;

 private:
  void on_publication_matched(
      eprosima::fastdds::dds::DataWriter* writer,
      const eprosima::fastdds::dds::PublicationMatchedStatus& status) override;

  std::shared_ptr<Participant> participant_;
  std::shared_ptr<eprosima::fastdds::dds::Topic> topic_;
  std::function<void()> on_match_change_;
  std::atomic<std::size_t> readers_ = 0;
  mutable std::mutex matched_mutex_;
  std::set<eprosima::fastrtps::rtps::InstanceHandle_t> matched_;
  std::string guid_;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
};

/// A data reader with its topic. Loaned samples share ownership of it, so it is deleted only
/// after the last of them is back.
class ReaderHandle {
 public:
  ReaderHandle(std::shared_ptr<Participant> participant,
               const std::string& topic_name,
               eprosima::fastdds::dds::TopicDataType* type,
               const eprosima::fastdds::dds::DataReaderQos& qos);
  ReaderHandle(const ReaderHandle&) = delete;
  ReaderHandle& operator=(const ReaderHandle&) = delete;
  ~ReaderHandle();

  eprosima::fastdds::dds::DataReader* operator->() const { return reader_; }
  /// Becomes true when data arrive.
  [[nodiscard]] eprosima::fastdds::dds::Condition* data_condition() const;
  [[nodiscard]] std::size_t writer_count() const;
  /// True if the sample was written by an endpoint of this process' participant.
  [[nodiscard]] bool from_this_participant(const eprosima::fastdds::dds::SampleInfo& info) const;

 private:
  std::shared_ptr<Participant> participant_;
  std::shared_ptr<eprosima::fastdds::dds::Topic> topic_;
  std::string guid_;
  eprosima::fastdds::dds::DataReader* reader_ = nullptr;
};

/// Follows the sequence numbers of every writer that a reader hears. DDS does not report what
/// KEEP_LAST replaced; gaps in the numbers do.
class SequenceTracker {
 public:
  [[nodiscard]] MessageInfo track(const eprosima::fastdds::dds::SampleInfo& info);

 private:
  std::map<eprosima::fastrtps::rtps::InstanceHandle_t, std::uint64_t> last_of_writer_;
};

/// Counters of a subscription, written by its executor's thread and read by any.
struct AtomicStats {
  std::atomic<std::uint64_t> received = 0;
  std::atomic<std::uint64_t> lost = 0;
  std::atomic<std::uint64_t> rejected = 0;
  std::atomic<std::uint64_t> starved = 0;

  void count(const MessageInfo& info) {
    ++received;
    lost += info.lost_before;
  }
  [[nodiscard]] SubscriptionStats snapshot() const { return {received, lost, rejected, starved}; }
};

/// Parameters of a write on behalf of somebody who sent the message at that time (ns; 0: now).
[[nodiscard]] eprosima::fastrtps::rtps::WriteParams write_parameters(std::int64_t publish_stamp_ns);

/// DDS name of a topic's in-place samples: unique to this process, so that no other matches it.
[[nodiscard]] std::string in_place_topic_name(const Participant& participant,
                                              const std::string& topic);
/// DDS name of a topic's samples in memory shared between processes.
[[nodiscard]] std::string shared_topic_name(const std::string& topic);
/// DDS name of a topic on the wire, which is ROS 2's.
[[nodiscard]] std::string wire_topic_name(const std::string& topic);

}  // namespace camvox::dds
