#include "camvox/storage/cdr_value.hpp"

#include <algorithm>
#include <array>
#include <charconv>

namespace camvox::storage {
namespace {

constexpr std::size_t kMaxValues = 1'000'000;
constexpr std::size_t kHeadSize = 4;

template <typename T>
T load(Bytes bytes, bool swapped) {
  std::array<std::byte, sizeof(T)> raw;
  std::copy_n(bytes.begin(), sizeof(T), raw.begin());
  if (swapped) std::reverse(raw.begin(), raw.end());
  T value;
  std::memcpy(&value, raw.data(), sizeof(T));
  return value;
}

CdrValue load_number(FieldKind kind, Bytes bytes, bool swapped) {
  const auto as_signed = [](std::int64_t value) { return CdrValue{value}; };
  const auto as_unsigned = [](std::uint64_t value) { return CdrValue{value}; };
  switch (kind) {
    case FieldKind::kBool:
      return CdrValue{bytes[0] != std::byte{0}};
    case FieldKind::kInt8:
      return as_signed(load<std::int8_t>(bytes, swapped));
    case FieldKind::kInt16:
      return as_signed(load<std::int16_t>(bytes, swapped));
    case FieldKind::kUint16:
      return as_unsigned(load<std::uint16_t>(bytes, swapped));
    case FieldKind::kInt32:
      return as_signed(load<std::int32_t>(bytes, swapped));
    case FieldKind::kUint32:
      return as_unsigned(load<std::uint32_t>(bytes, swapped));
    case FieldKind::kInt64:
      return as_signed(load<std::int64_t>(bytes, swapped));
    case FieldKind::kUint64:
      return as_unsigned(load<std::uint64_t>(bytes, swapped));
    case FieldKind::kFloat32:
      return CdrValue{load<float>(bytes, swapped)};
    case FieldKind::kFloat64:
      return CdrValue{load<double>(bytes, swapped)};
    default:
      return as_unsigned(load<std::uint8_t>(bytes, swapped));
  }
}

std::string to_utf8(char16_t unit) {
  const auto byte = [](unsigned value) { return static_cast<char>(value); };
  const unsigned u = unit;
  if (u < 0x80) return {byte(u)};
  if (u < 0x800) return {byte(0xC0U | u >> 6U), byte(0x80U | (u & 0x3FU))};
  return {byte(0xE0U | u >> 12U), byte(0x80U | (u >> 6U & 0x3FU)), byte(0x80U | (u & 0x3FU))};
}

/// Follows the schema through the bytes. The first error stops it.
class Decoder {
 public:
  Decoder(const MessageSchema& schema, Bytes cdr) : schema_(schema), cdr_(cdr) {}

  Result<CdrValue> run() {
    if (cdr_.size() < kHeadSize) {
      failed(StatusCode::kTruncated, "it has no CDR head");
      return status_;
    }
    const auto representation =
        std::to_integer<unsigned>(cdr_[0]) << 8U | std::to_integer<unsigned>(cdr_[1]);
    if (representation > 1) {
      return Status(StatusCode::kUnsupported,
                    "message in representation " + std::to_string(representation) +
                        "; known are 0 and 1, plain CDR");
    }
    swapped_ = representation == 0;
    position_ = kHeadSize;
    CdrValue value = message(schema_.root());
    if (!status_.ok()) return status_;
    return value;
  }

 private:
  void failed(StatusCode code, const std::string& what) {
    if (!status_.ok()) return;
    status_ = {code, schema_.root().type + " at byte " + std::to_string(position_) + ": " + what};
  }

  /// `size` bytes, after padding to the alignment, which counts from behind the head.
  Bytes take(std::size_t size, std::size_t alignment) {
    if (!status_.ok()) return {};
    const std::size_t padding = (alignment - (position_ - kHeadSize) % alignment) % alignment;
    const std::size_t left = cdr_.size() - position_;
    if (padding > left || size > left - padding) {
      failed(StatusCode::kTruncated, "the data end inside a field");
      return {};
    }
    position_ += padding + size;
    return cdr_.subspan(position_ - size, size);
  }

  std::uint32_t length() {
    const Bytes bytes = take(4, 4);
    return bytes.empty() ? 0 : load<std::uint32_t>(bytes, swapped_);
  }

  /// Whether one more value may be kept: a forged count must not take all memory.
  bool count_value() {
    if (++values_ > kMaxValues) failed(StatusCode::kLimit, "more than a million values");
    return status_.ok();
  }

  CdrValue message(const MessageDefinition& definition) {
    CdrMembers members;
    members.reserve(definition.fields.size());
    for (const auto& field : definition.fields) {
      if (!status_.ok()) break;
      members.push_back({field.name, value(field)});
    }
    // A struct without members has one byte in ROS 2 (structure_needs_at_least_one_member). Only
    // for a whole message may it be missing; inside, it keeps a forged count from costing nothing.
    const bool is_whole_message = position_ == kHeadSize && position_ == cdr_.size();
    if (definition.fields.empty() && !is_whole_message) (void)take(1, 1);
    return CdrValue{std::move(members)};
  }

  CdrValue value(const Field& field) {
    if (field.array == FieldArray::kNone) return single(field);
    const std::uint32_t count = field.array == FieldArray::kFixed ? field.array_size : length();
    if (field.array == FieldArray::kBounded && count > field.array_size) {
      failed(StatusCode::kCorrupt, field.name + " has more elements than its bound");
    }
    return size_of(field.kind) > 0 ? numbers(field, count) : list(field, count);
  }

  CdrValue numbers(const Field& field, std::uint32_t count) {
    const std::size_t size = size_of(field.kind);
    // An empty sequence has no padding behind its length.
    const Bytes bytes = count == 0 ? Bytes() : take(count * size, size);
    count_value();
    return CdrValue{CdrArray{field.kind, bytes, swapped_}};
  }

  CdrValue list(const Field& field, std::uint32_t count) {
    CdrList values;
    for (std::uint32_t i = 0; i < count && status_.ok(); ++i) values.push_back(single(field));
    return CdrValue{std::move(values)};
  }

  CdrValue single(const Field& field) {
    if (!count_value()) return {};
    if (field.kind == FieldKind::kMessage) return message(schema_.definition(field.message_type));
    if (field.kind == FieldKind::kString) return string(field);
    if (field.kind == FieldKind::kWstring) return wstring();
    const std::size_t size = size_of(field.kind);
    const Bytes bytes = take(size, size);
    return bytes.empty() ? CdrValue{} : load_number(field.kind, bytes, swapped_);
  }

  CdrValue string(const Field& field) {
    const Bytes bytes = take(length(), 1);
    std::string_view text = as_text(bytes);
    // The zero at the end counts; some writers leave both out for an empty string.
    if (!text.empty() && text.back() != '\0') {
      failed(StatusCode::kCorrupt, field.name + " is a string without its end");
    }
    if (!text.empty()) text.remove_suffix(1);
    return CdrValue{std::string(text)};
  }

  CdrValue wstring() {
    const std::uint32_t count = length();
    std::string text;
    for (std::uint32_t i = 0; i < count && status_.ok(); ++i) {
      const Bytes unit = take(4, 4);  // as Fast CDR: 4 bytes for each
      if (!unit.empty())
        text += to_utf8(static_cast<char16_t>(load<std::uint32_t>(unit, swapped_)));
    }
    return CdrValue{std::move(text)};
  }

  const MessageSchema& schema_;
  Bytes cdr_;
  bool swapped_ = false;
  std::size_t position_ = 0;
  std::size_t values_ = 0;
  Status status_;
};

/// Splits "a[1].b" into "a" and the rest "[1].b".
std::string_view take_name(std::string_view& path) {
  const std::size_t end = std::min(path.find_first_of(".["), path.size());
  const auto name = path.substr(0, end);
  path.remove_prefix(end);
  return name;
}

std::optional<CdrValue> element_of(const CdrValue& value, std::string_view& path) {
  const std::size_t close = path.find(']');
  std::size_t index = 0;
  if (close == std::string_view::npos) return std::nullopt;
  const auto [end, error] = std::from_chars(path.data() + 1, path.data() + close, index);
  if (error != std::errc() || end != path.data() + close) return std::nullopt;
  path.remove_prefix(close + 1);
  if (const auto* list = std::get_if<CdrList>(&value.data); list && index < list->size()) {
    return (*list)[index];
  }
  if (const auto* array = std::get_if<CdrArray>(&value.data); array && index < array->size()) {
    return array->element(index);
  }
  return std::nullopt;
}

}  // namespace

CdrValue CdrArray::element(std::size_t index) const {
  return load_number(kind, bytes.subspan(index * size_of(kind), size_of(kind)), swapped);
}

std::optional<CdrValue> CdrValue::at(std::string_view path) const {
  if (path.empty()) return *this;
  if (path.front() == '[') {
    const auto value = element_of(*this, path);
    return value ? value->at(path) : std::nullopt;
  }
  if (path.front() == '.') path.remove_prefix(1);
  const auto* members = std::get_if<CdrMembers>(&data);
  if (members == nullptr || path.empty()) return std::nullopt;
  const auto name = take_name(path);
  const auto it = std::find_if(members->begin(), members->end(), [&](const CdrMember& member) {
    return member.name == name;
  });
  return it == members->end() ? std::nullopt : it->value.at(path);
}

std::optional<double> CdrValue::as_double() const {
  if (const auto* v = std::get_if<double>(&data)) return *v;
  if (const auto* v = std::get_if<float>(&data)) return *v;
  if (const auto* v = std::get_if<std::uint64_t>(&data)) return static_cast<double>(*v);
  if (const auto integer = as_integer()) return static_cast<double>(*integer);
  return std::nullopt;
}

std::optional<std::int64_t> CdrValue::as_integer() const {
  if (const auto* v = std::get_if<bool>(&data)) return *v ? 1 : 0;
  if (const auto* v = std::get_if<std::int64_t>(&data)) return *v;
  const auto* v = std::get_if<std::uint64_t>(&data);
  if (v == nullptr || *v > static_cast<std::uint64_t>(INT64_MAX)) return std::nullopt;
  return static_cast<std::int64_t>(*v);
}

Result<CdrValue> decode_cdr(const MessageSchema& schema, Bytes cdr) {
  return Decoder(schema, cdr).run();
}

std::optional<std::int64_t> header_stamp_ns(const CdrValue& message) {
  for (const char* path : {"header.stamp", "stamp"}) {
    const auto stamp = message.at(path);
    if (!stamp) continue;
    const auto sec = stamp->at("sec");
    const auto nanosec = stamp->at("nanosec");
    if (!sec || !nanosec) continue;
    const auto seconds = sec->as_integer();
    const auto nanoseconds = nanosec->as_integer();
    // As in the definition, 32 bits each, so that the product cannot overflow.
    if (seconds && nanoseconds && *seconds >= INT32_MIN && *seconds <= INT32_MAX &&
        *nanoseconds >= 0 && *nanoseconds <= UINT32_MAX) {
      return *seconds * 1'000'000'000 + *nanoseconds;
    }
  }
  return std::nullopt;
}

}  // namespace camvox::storage
