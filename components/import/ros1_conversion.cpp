#include "ros1_conversion.hpp"

#include <algorithm>
#include <cctype>
#include <sstream>

#include "import_error.hpp"

namespace camvox::import {
namespace {

using storage::ByteReader;
using storage::Bytes;
using storage::Field;
using storage::FieldArray;
using storage::FieldKind;

constexpr std::size_t kEncapsulation = 4;

[[noreturn]] void differ(const std::string& what) {
  throw ImportError(storage::StatusCode::kUnsupported, what);
}

/// CDR aligns numbers to their size, counted behind the encapsulation.
void align(std::vector<std::uint8_t>& cdr, std::size_t size) {
  while ((cdr.size() - kEncapsulation) % size != 0) cdr.push_back(0);
}

void append(std::vector<std::uint8_t>& cdr, Bytes bytes) {
  const auto* begin = reinterpret_cast<const std::uint8_t*>(bytes.data());
  cdr.insert(cdr.end(), begin, begin + bytes.size());
}

void append_length(std::vector<std::uint8_t>& cdr, std::uint32_t length) {
  align(cdr, sizeof(length));
  append(cdr, std::as_bytes(std::span(&length, 1)));
}

/// Whether the kinds have the same bytes; byte and char have other signs in ROS 1 and ROS 2.
bool same_kind(FieldKind a, FieldKind b) {
  const auto octet = [](FieldKind kind) {
    return kind == FieldKind::kByte || kind == FieldKind::kChar || kind == FieldKind::kInt8 ||
           kind == FieldKind::kUint8;
  };
  return a == b || (octet(a) && octet(b));
}

bool convert_string(ByteReader& in, std::vector<std::uint8_t>& cdr) {
  const auto text = in.bytes32();
  append_length(cdr, static_cast<std::uint32_t>(text.size() + 1));
  append(cdr, text);
  cdr.push_back(0);
  return in.ok();
}

bool convert_numbers(std::size_t size,
                     std::uint64_t count,
                     ByteReader& in,
                     std::vector<std::uint8_t>& cdr) {
  const auto bytes = in.take(size * count);
  if (!bytes.empty()) align(cdr, size);
  append(cdr, bytes);
  return in.ok();
}

/// Any value but 0 is true in ROS 1; in CDR only 1 is.
bool convert_bools(std::uint64_t count, ByteReader& in, std::vector<std::uint8_t>& cdr) {
  for (const auto value : in.take(count)) cdr.push_back(value == std::byte{0} ? 0 : 1);
  return in.ok();
}

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// "time[]" -> "builtin_interfaces/Time[]"; others stay.
std::string ros2_type(const std::string& type) {
  const auto bracket = std::min(type.find('['), type.size());
  const auto name = type.substr(0, bracket);
  const auto array = type.substr(bracket);
  if (name == "Header" || name == "roslib/Header") return "std_msgs/Header" + array;
  if (name == "time") return "builtin_interfaces/Time" + array;
  if (name == "duration") return "builtin_interfaces/Duration" + array;
  return type;
}

}  // namespace

std::string to_ros2_definition(const std::string& ros1_definition) {
  std::istringstream lines(ros1_definition);
  std::string out;
  std::string line;
  while (std::getline(lines, line)) {
    if (line.starts_with("====") || line.starts_with("MSG:")) {
      out += line + "\n";
      continue;
    }
    std::istringstream words(line.substr(0, line.find('#')));
    std::string type, name;
    if (!(words >> type >> name) || line.substr(0, line.find('#')).find('=') != std::string::npos) {
      continue;  // blank, or a constant
    }
    out += ros2_type(type) + " " + lower(name) + "\n";
  }
  const std::string separator(80, '=');
  for (const std::string name : {"Time", "Duration"}) {
    out += separator + "\nMSG: builtin_interfaces/" + name + "\nint32 sec\nuint32 nanosec\n";
  }
  return out;
}

Ros1Conversion::Ros1Conversion(const std::string& ros1_type,
                               const std::string& definition,
                               const storage::MessageSchema& target) {
  const auto source = storage::MessageSchema::parse(ros1_type, to_ros2_definition(definition));
  if (!source.ok()) differ("its definition cannot be read: " + source.status().message());
  steps_ = plan(*source, source->root(), target, target.root());
}

Ros1Conversion::Steps Ros1Conversion::plan(const storage::MessageSchema& from,
                                           const storage::MessageDefinition& source,
                                           const storage::MessageSchema& to,
                                           const storage::MessageDefinition& target) {
  Steps steps;
  auto next = source.fields.begin();
  if (next != source.fields.end() && target.type == "std_msgs/msg/Header" && next->name == "seq" &&
      next->kind == FieldKind::kUint32 && next->array == FieldArray::kNone) {
    steps.push_back({Step::Kind::kDrop, sizeof(std::uint32_t), FieldArray::kNone, 1, {}});
    ++next;
  }
  for (const auto& field : target.fields) {
    const bool there = next != source.fields.end() && next->name == field.name;
    if (there) {
      plan_field(from, *next++, to, field, steps);
    } else if (target.type.ends_with("/CustomPoint") && field.name == "tag") {
      steps.push_back({Step::Kind::kZero, sizeof(std::uint8_t), FieldArray::kNone, 1, {}});
    } else {
      differ(source.type + " has " +
             (next == source.fields.end() ? "no field" : next->name + " in place of") + " " +
             field.name);
    }
  }
  if (next != source.fields.end()) differ(source.type + " has a field " + next->name + " more");
  return steps;
}

void Ros1Conversion::plan_field(const storage::MessageSchema& from,
                                const Field& source,
                                const storage::MessageSchema& to,
                                const Field& target,
                                Steps& steps) {
  if (!same_kind(source.kind, target.kind) || source.array != target.array ||
      source.array_size != target.array_size || source.kind == FieldKind::kWstring) {
    differ("its field " + source.name + " has another type");
  }
  Step step;
  step.array = source.array;
  step.count = source.array == FieldArray::kFixed ? source.array_size : 1;
  if (source.kind == FieldKind::kMessage) {
    auto element =
        plan(from, from.definition(source.message_type), to, to.definition(target.message_type));
    if (source.array == FieldArray::kNone) {
      std::ranges::move(element, std::back_inserter(steps));
      return;
    }
    step.kind = Step::Kind::kMessages;
    step.element = std::move(element);
  } else if (source.kind == FieldKind::kString) {
    step.kind = Step::Kind::kString;
  } else {
    step.kind = source.kind == FieldKind::kBool ? Step::Kind::kBool : Step::Kind::kNumber;
    step.size = storage::size_of(source.kind);
  }
  steps.push_back(std::move(step));
}

bool Ros1Conversion::convert(Bytes message, std::vector<std::uint8_t>& cdr) const {
  cdr.assign({0, 1, 0, 0});  // CDR, little-endian
  cdr.reserve(message.size() + message.size() / 4);
  ByteReader in(message);
  return run(steps_, in, cdr) && in.remaining() == 0;
}

bool Ros1Conversion::run(const Steps& steps, ByteReader& in, std::vector<std::uint8_t>& cdr) {
  return std::ranges::all_of(steps, [&](const Step& step) { return run_step(step, in, cdr); });
}

bool Ros1Conversion::run_step(const Step& step, ByteReader& in, std::vector<std::uint8_t>& cdr) {
  std::uint64_t count = step.count;
  if (step.array == FieldArray::kUnbounded) {
    const auto length = in.number<std::uint32_t>();
    // An element has at least one byte: a forged length ends here and not in the memory.
    if (!in.ok() || length > in.remaining()) return false;
    append_length(cdr, length);
    count = length;
  }
  switch (step.kind) {
    case Step::Kind::kNumber:
      return convert_numbers(step.size, count, in, cdr);
    case Step::Kind::kBool:
      return convert_bools(count, in, cdr);
    case Step::Kind::kString:
      for (; count > 0; --count) {
        if (!convert_string(in, cdr)) return false;
      }
      return true;
    case Step::Kind::kMessages:
      for (; count > 0; --count) {
        if (!run(step.element, in, cdr)) return false;
      }
      return true;
    case Step::Kind::kDrop:
      (void)in.take(step.size);
      return in.ok();
    case Step::Kind::kZero:
      cdr.insert(cdr.end(), step.size, 0);
      return true;
  }
  return false;
}

}  // namespace camvox::import
