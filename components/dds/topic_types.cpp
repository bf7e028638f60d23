#include "topic_types.hpp"

namespace camvox::dds {
namespace {

constexpr std::size_t kEncapsulationBytes = 4;

}  // namespace

TopicTypeBase::TopicTypeBase(const std::string& name, std::size_t payload_bytes) {
  setName(name.c_str());
  m_typeSize = static_cast<std::uint32_t>(payload_bytes + kEncapsulationBytes);
  m_isGetKeyDefined = false;
  auto_fill_type_object(false);
  auto_fill_type_information(false);
}

std::function<std::uint32_t()> PlainTopicType::getSerializedSizeProvider(void*) {
  return [size = m_typeSize] { return size; };
}

PlainTopicType* make_plain_topic_type(const interfaces::MessageType& type) {
  return new PlainTopicType(type.dds_name + "in_place/" + type.type_hash, type.size);
}

bool WireTopicType::serialize(void* data, SerializedPayload_t* payload) {
  const auto& wire = *static_cast<WireData*>(data);
  const std::size_t written = wire.type->write_cdr(wire.message, payload->data, payload->max_size);
  payload->encapsulation = CDR_LE;
  payload->length = static_cast<std::uint32_t>(written);
  return written > 0;
}

bool WireTopicType::deserialize(SerializedPayload_t* payload, void* data) {
  auto& wire = *static_cast<WireData*>(data);
  wire.well_formed = wire.type->read_cdr(payload->data, payload->length, wire.message);
  return true;
}

std::function<std::uint32_t()> WireTopicType::getSerializedSizeProvider(void* data) {
  return [data] {
    const auto& wire = *static_cast<WireData*>(data);
    // An invalid message gets no room; serialize() then refuses it.
    if (!wire.type->counters_valid(wire.message)) return std::uint32_t{0};
    return static_cast<std::uint32_t>(wire.type->cdr_size(wire.message));
  };
}

}  // namespace camvox::dds
