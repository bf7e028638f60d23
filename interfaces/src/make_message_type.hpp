#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <string>

#include "camvox/interfaces/message_type.hpp"
#include "plain_codec.hpp"

/// Fills a MessageType for one C++ struct.
namespace camvox::interfaces::internal {

inline constexpr std::size_t kEncapsulationBytes = 4;
inline constexpr std::uint8_t kCdrLittleEndian = 1;

/// Visits a message that the visitor only reads. The generated const getters return copies of
/// scalars, and a copy has no address in the layout, hence the cast.
template <typename T, typename Visitor>
void visit_const(const void* message, Visitor&& visitor) {
  PlainLayout<T>::visit(*static_cast<T*>(const_cast<void*>(message)), visitor);
}

template <typename T>
std::size_t plain_cdr_size(const void* message) {
  CdrSize size;
  visit_const<T>(message, size);
  return size.bytes + kEncapsulationBytes;
}

template <typename T>
bool plain_counters_valid(const void* message) {
  CounterCheck check;
  visit_const<T>(message, check);
  return check.valid;
}

template <typename T>
std::size_t plain_write_cdr(const void* message, std::uint8_t* data, std::size_t size) {
  if (!plain_counters_valid<T>(message)) return 0;
  const std::size_t needed = plain_cdr_size<T>(message);
  if (needed > size) return 0;
  const std::uint8_t encapsulation[kEncapsulationBytes] = {0, kCdrLittleEndian, 0, 0};
  std::memcpy(data, encapsulation, kEncapsulationBytes);
  visit_const<T>(message, CdrWriter(data + kEncapsulationBytes));
  return needed;
}

template <typename T>
bool plain_read_cdr(const std::uint8_t* data, std::size_t size, void* message) {
  if (size < kEncapsulationBytes || data[0] != 0 || data[1] != kCdrLittleEndian) return false;
  CdrReader reader(data + kEncapsulationBytes, size - kEncapsulationBytes);
  PlainLayout<T>::visit(*static_cast<T*>(message), reader);
  return reader.ok();
}

template <typename T>
void plain_copy(const void* from, void* to) {
  visit_const<T>(from, UsedPartCopy(from, to));
}

template <typename T>
void plain_reset(void* message) {
  PlainLayout<T>::visit(*static_cast<T*>(message), Clear{});
}

template <typename T>
std::size_t ros_cdr_size(const void* message) {
  return T::getCdrSerializedSize(*static_cast<const T*>(message)) + kEncapsulationBytes;
}

template <typename T>
std::size_t ros_write_cdr(const void* message, std::uint8_t* data, std::size_t size) {
  using eprosima::fastcdr::Cdr;
  // Fast CDR steps over alignment gaps; what was in the buffer before must not leave the process,
  // and the same message must give the same bytes.
  std::memset(data, 0, std::min(size, ros_cdr_size<T>(message)));
  try {
    eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(data), size);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.serialize_encapsulation();
    static_cast<const T*>(message)->serialize(cdr);
    return cdr.getSerializedDataLength();
  } catch (const std::exception&) {
    return 0;  // does not fit
  }
}

template <typename T>
bool ros_read_cdr(const std::uint8_t* data, std::size_t size, void* message) {
  using eprosima::fastcdr::Cdr;
  // Fast CDR would take parameter lists (2, 3) for structs.
  if (size < kEncapsulationBytes || data[0] != 0 || data[1] > kCdrLittleEndian) return false;
  try {
    auto* bytes = reinterpret_cast<char*>(const_cast<std::uint8_t*>(data));
    eprosima::fastcdr::FastBuffer buffer(bytes, size);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    static_cast<T*>(message)->deserialize(cdr);
    return true;
  } catch (const std::exception&) {
    return false;  // short, an impossible bool or length, out of memory: all mean "malformed"
  }
}

template <typename T>
MessageType make_common(const char* ros_name, const char* hash, std::string_view schema) {
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

/// Throws std::logic_error if the compiler laid the struct out differently from CDR.
template <typename T>
MessageType make_plain_message_type(const char* ros_name,
                                    const char* hash,
                                    std::string_view schema) {
  using namespace internal;
  if (sizeof(T) != T::getMaxCdrSerializedSize()) {
    throw std::logic_error(std::string(ros_name) +
                           ": C++ layout differs from CDR layout, add explicit padding");
  }
  MessageType type = make_common<T>(ros_name, hash, schema);
  type.plain = true;
  type.reset = plain_reset<T>;
  type.copy = plain_copy<T>;
  type.counters_valid = plain_counters_valid<T>;
  type.cdr_size = plain_cdr_size<T>;
  type.write_cdr = plain_write_cdr<T>;
  type.read_cdr = plain_read_cdr<T>;
  return type;
}

template <typename T>
MessageType make_ros_message_type(const char* ros_name, const char* hash, std::string_view schema) {
  using namespace internal;
  MessageType type = make_common<T>(ros_name, hash, schema);
  type.reset = [](void* message) { *static_cast<T*>(message) = T(); };
  type.copy = [](const void* from, void* to) {
    *static_cast<T*>(to) = *static_cast<const T*>(from);
  };
  type.counters_valid = [](const void*) { return true; };
  type.cdr_size = ros_cdr_size<T>;
  type.write_cdr = ros_write_cdr<T>;
  type.read_cdr = ros_read_cdr<T>;
  return type;
}

}  // namespace camvox::interfaces
