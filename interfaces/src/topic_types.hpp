#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <exception>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <new>
#include <stdexcept>

#include "camvox/interfaces/message_type.hpp"
#include "plain_codec.hpp"

/// The DDS type supports behind MessageType. Ours instead of the generated ones, because those
/// let exceptions of malformed input out of the reader, and send a plain type at full capacity.
namespace camvox::interfaces::internal {

inline constexpr std::uint32_t kEncapsulationBytes = 4;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

/// What all of our topic types share: no key, no type objects in discovery (ROS 2 compares only
/// names then).
class TopicTypeBase : public eprosima::fastdds::dds::TopicDataType {
 public:
  TopicTypeBase(const std::string& name, std::size_t payload_bytes) {
    setName(name.c_str());
    m_typeSize = static_cast<std::uint32_t>(payload_bytes) + kEncapsulationBytes;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

inline void write_encapsulation(std::uint8_t* data) {
  data[0] = 0;
  data[1] = 1;  // CDR_LE
  data[2] = 0;
  data[3] = 0;
}

/// Visits a message that the visitor only reads. The generated const getters return copies of
/// scalars, and a copy has no address in the layout, hence the cast.
template <typename T, typename Visitor>
void visit_const(const void* message, Visitor&& visitor) {
  PlainLayout<T>::visit(*static_cast<T*>(const_cast<void*>(message)), visitor);
}

template <typename T>
std::size_t plain_cdr_size(const T& message) {
  CdrSize size;
  visit_const<T>(&message, size);
  return size.bytes + kEncapsulationBytes;
}

template <typename T>
void plain_to_cdr(const T& message, std::uint8_t* data) {
  write_encapsulation(data);
  visit_const<T>(&message, CdrWriter(data + kEncapsulationBytes));
}

template <typename T>
bool plain_from_cdr(const std::uint8_t* data, std::size_t size, void* message) {
  if (size < kEncapsulationBytes || data[1] != 1) return false;
  CdrReader reader(data + kEncapsulationBytes, size - kEncapsulationBytes);
  PlainLayout<T>::visit(*static_cast<T*>(message), reader);
  return reader.ok();
}

template <typename T>
bool plain_counters_valid(const void* message) {
  CounterCheck check;
  visit_const<T>(message, check);
  return check.valid;
}

template <typename T>
void plain_copy(const void* from, void* to) {
  visit_const<T>(from, UsedPartCopy(from, to));
}

/// A plain type at its in-place layout: what a loan points at is the payload itself.
template <typename T>
class PlainTopicType final : public TopicTypeBase {
 public:
  explicit PlainTopicType(const std::string& name) : TopicTypeBase(name, sizeof(T)) {
    if (sizeof(T) != T::getMaxCdrSerializedSize()) {
      throw std::logic_error(name + ": C++ layout differs from CDR layout, add explicit padding");
    }
  }
  bool is_plain() const override { return true; }
  bool is_bounded() const override { return true; }
  bool serialize(void* data, SerializedPayload_t* payload) override {
    if (payload->max_size < m_typeSize) return false;
    write_encapsulation(payload->data);
    plain_copy<T>(data, payload->data + kEncapsulationBytes);
    payload->encapsulation = CDR_LE;
    payload->length = m_typeSize;
    return true;
  }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    const void* message = payload->data + kEncapsulationBytes;
    if (payload->length != m_typeSize || !plain_counters_valid<T>(message)) return false;
    plain_copy<T>(message, data);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [size = m_typeSize] { return size; };
  }
  void* createData() override { return new T(); }
  void deleteData(void* data) override { delete static_cast<T*>(data); }
};

/// A plain type as it crosses a process: CDR of the ROS 2 message, lists trimmed to their use.
template <typename T>
class TrimmedTopicType final : public TopicTypeBase {
 public:
  explicit TrimmedTopicType(const std::string& name) : TopicTypeBase(name, kFirstPayloadBytes) {}
  bool serialize(void* data, SerializedPayload_t* payload) override {
    const auto& message = *static_cast<const T*>(data);
    const std::size_t size = plain_cdr_size(message);
    if (payload->max_size < size || !plain_counters_valid<T>(data)) return false;
    plain_to_cdr(message, payload->data);
    payload->encapsulation = CDR_LE;
    payload->length = static_cast<std::uint32_t>(size);
    return true;
  }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    return plain_from_cdr<T>(payload->data, payload->length, data);
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] {
      // A broken counter gives a payload too small for its content: serialize() then refuses.
      if (!plain_counters_valid<T>(data)) return std::uint32_t{0};
      return static_cast<std::uint32_t>(plain_cdr_size(*static_cast<const T*>(data)));
    };
  }
  void* createData() override { return new T(); }
  void deleteData(void* data) override { delete static_cast<T*>(data); }

 private:
  static constexpr std::size_t kFirstPayloadBytes = 1024;  // grows with what is really sent
};

template <typename T>
bool ros_from_cdr(const std::uint8_t* data, std::size_t size, void* message) {
  try {
    eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(const_cast<std::uint8_t*>(data)),
                                         size);
    eprosima::fastcdr::Cdr cdr(buffer,
                               eprosima::fastcdr::Cdr::DEFAULT_ENDIAN,
                               eprosima::fastcdr::Cdr::DDS_CDR);
    cdr.read_encapsulation();
    static_cast<T*>(message)->deserialize(cdr);
    return true;
  } catch (const std::exception&) {
    return false;  // short, an impossible bool or length, out of memory: all mean "malformed"
  }
}

template <typename T>
std::size_t ros_to_cdr(const T& message, std::uint8_t* data, std::size_t capacity) {
  eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(data), capacity);
  eprosima::fastcdr::Cdr cdr(buffer,
                             eprosima::fastcdr::Cdr::DEFAULT_ENDIAN,
                             eprosima::fastcdr::Cdr::DDS_CDR);
  cdr.serialize_encapsulation();
  message.serialize(cdr);
  return cdr.getSerializedDataLength();
}

/// A ROS 2 message with strings and sequences, serialised by Fast CDR.
template <typename T>
class RosTopicType final : public TopicTypeBase {
 public:
  explicit RosTopicType(const std::string& name) : TopicTypeBase(name, kFirstPayloadBytes) {}
  bool serialize(void* data, SerializedPayload_t* payload) override {
    try {
      payload->length = static_cast<std::uint32_t>(
          ros_to_cdr(*static_cast<const T*>(data), payload->data, payload->max_size));
    } catch (const std::exception&) {
      return false;
    }
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    return ros_from_cdr<T>(payload->data, payload->length, data);
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] {
      return static_cast<std::uint32_t>(T::getCdrSerializedSize(*static_cast<const T*>(data))) +
             kEncapsulationBytes;
    };
  }
  void* createData() override { return new T(); }
  void deleteData(void* data) override { delete static_cast<T*>(data); }

 private:
  static constexpr std::size_t kFirstPayloadBytes = 1024;  // grows with what is really sent
};

template <typename T>
MessageType make_common_message_type(const char* ros_name, const char* hash, std::string_view schema) {
  MessageType type;
  type.ros_name = ros_name;
  type.dds_name = to_dds_type_name(ros_name);
  type.type_hash = hash;
  type.schema = schema;
  type.size = sizeof(T);
  type.create = []() -> void* { return new T(); };
  type.destroy = [](void* message) { delete static_cast<T*>(message); };
  return type;
}

}  // namespace camvox::interfaces::internal

namespace camvox::interfaces {

template <typename T>
MessageType make_plain_message_type(const char* ros_name,
                                    const char* hash,
                                    std::string_view schema) {
  using namespace internal;
  MessageType type = make_common_message_type<T>(ros_name, hash, schema);
  type.plain = true;
  type.make_wire_type = []() -> eprosima::fastdds::dds::TopicDataType* {
    return new TrimmedTopicType<T>(message_type<T>().dds_name);
  };
  type.make_plain_type = []() -> eprosima::fastdds::dds::TopicDataType* {
    // The hash in the name keeps processes with other layouts or capacities from matching.
    return new PlainTopicType<T>(message_type<T>().dds_name + message_type<T>().type_hash);
  };
  type.copy = plain_copy<T>;
  type.counters_valid = plain_counters_valid<T>;
  type.to_cdr = [](const void* message) {
    const auto& typed = *static_cast<const T*>(message);
    std::vector<std::uint8_t> data(plain_cdr_size(typed));
    plain_to_cdr(typed, data.data());
    return data;
  };
  type.from_cdr = plain_from_cdr<T>;
  return type;
}

template <typename T>
MessageType make_ros_message_type(const char* ros_name, const char* hash, std::string_view schema) {
  using namespace internal;
  MessageType type = make_common_message_type<T>(ros_name, hash, schema);
  type.make_wire_type = []() -> eprosima::fastdds::dds::TopicDataType* {
    return new RosTopicType<T>(message_type<T>().dds_name);
  };
  type.copy = [](const void* from, void* to) {
    *static_cast<T*>(to) = *static_cast<const T*>(from);
  };
  type.counters_valid = [](const void*) { return true; };
  type.to_cdr = [](const void* message) {
    const auto& typed = *static_cast<const T*>(message);
    std::vector<std::uint8_t> data(T::getCdrSerializedSize(typed) + kEncapsulationBytes);
    data.resize(ros_to_cdr(typed, data.data(), data.size()));
    return data;
  };
  type.from_cdr = ros_from_cdr<T>;
  return type;
}

}  // namespace camvox::interfaces
