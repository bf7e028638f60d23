#pragma once

#include <cstdint>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <string>

#include "camvox/interfaces/message_type.hpp"

/// The two DDS type supports of this layer. They are generic, so that one DDS topic can have typed
/// and raw endpoints at the same time; what a message is made of is told with each call.
namespace camvox::dds {

using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

/// No key, and no type objects in discovery: ROS 2 then compares only the type's name.
class TopicTypeBase : public eprosima::fastdds::dds::TopicDataType {
 public:
  TopicTypeBase(const std::string& name, std::size_t payload_bytes);
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

/// A plain message at its in-place layout: what a loan points at is the payload itself. Messages
/// are only ever written and read through loans, so nothing is serialised.
class PlainTopicType final : public TopicTypeBase {
 public:
  PlainTopicType(const std::string& name, std::size_t message_bytes)
      : TopicTypeBase(name, message_bytes) {}
  bool is_plain() const override { return true; }
  bool is_bounded() const override { return true; }
  bool serialize(void*, SerializedPayload_t*) override { return false; }
  bool deserialize(SerializedPayload_t*, void*) override { return false; }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override;
  void* createData() override { return ::operator new(m_typeSize); }
  void deleteData(void* data) override { ::operator delete(data); }
};

/// The in-place topic type of a plain message. Its name differs from the wire type's (a participant
/// knows one type a name), and holds the hash, which keeps builds with other layouts apart.
[[nodiscard]] PlainTopicType* make_plain_topic_type(const interfaces::MessageType& type);

/// What WireTopicType is given as "data": a message and how it is coded.
struct WireData {
  const interfaces::MessageType* type = nullptr;
  void* message = nullptr;
  bool well_formed = true;  ///< Set when reading.
};

/// A message as CDR.
class WireTopicType final : public TopicTypeBase {
 public:
  explicit WireTopicType(const std::string& name) : TopicTypeBase(name, kFirstPayloadBytes) {}
  bool serialize(void* data, SerializedPayload_t* payload) override;
  /// Always succeeds; malformed input is told in `well_formed`, so that the library removes it
  /// from the history as any other message.
  bool deserialize(SerializedPayload_t* payload, void* data) override;
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override;
  void* createData() override { return new WireData; }
  void deleteData(void* data) override { delete static_cast<WireData*>(data); }

 private:
  static constexpr std::size_t kFirstPayloadBytes = 1024;  // grows with what is really sent
};

}  // namespace camvox::dds
