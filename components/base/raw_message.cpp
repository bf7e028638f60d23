#include "camvox/component/raw_message.hpp"

#include <cstring>

namespace camvox {
namespace {

constexpr std::size_t kEncapsulationBytes = 4;

}  // namespace

MessageType raw_message_type(std::string_view ros_name) {
  MessageType type;
  type.ros_name = ros_name;
  type.dds_name = interfaces::to_dds_type_name(ros_name);
  type.size = sizeof(RawMessage);
  type.create = []() -> void* { return new RawMessage; };
  type.destroy = [](void* message) { delete static_cast<RawMessage*>(message); };
  type.reset = [](void* message) { static_cast<RawMessage*>(message)->cdr.clear(); };
  type.copy = [](const void* from, void* to) {
    *static_cast<RawMessage*>(to) = *static_cast<const RawMessage*>(from);
  };
  type.counters_valid = [](const void*) { return true; };
  type.cdr_size = [](const void* message) {
    return static_cast<const RawMessage*>(message)->cdr.size();
  };
  type.write_cdr = [](const void* message, std::uint8_t* data, std::size_t size) {
    const auto& cdr = static_cast<const RawMessage*>(message)->cdr;
    if (cdr.size() > size || cdr.size() < kEncapsulationBytes) return std::size_t{0};
    std::memcpy(data, cdr.data(), cdr.size());
    return cdr.size();
  };
  type.read_cdr = [](const std::uint8_t* data, std::size_t size, void* message) {
    static_cast<RawMessage*>(message)->cdr.assign(data, data + size);
    return size >= kEncapsulationBytes;
  };
  return type;
}

}  // namespace camvox
