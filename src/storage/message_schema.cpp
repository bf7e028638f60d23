#include "camvox/storage/message_schema.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <set>
#include <sstream>
#include <utility>

namespace camvox::storage {
namespace {

constexpr int kMaxDepth = 64;
constexpr std::size_t kMaxTextSize = 16U << 20;
/// Elements of one fixed array that make sense in a definition.
constexpr std::uint32_t kMaxArraySize = 1U << 24;

constexpr std::array<std::pair<std::string_view, FieldKind>, 15> kKinds = {{
    {"bool", FieldKind::kBool},
    {"byte", FieldKind::kByte},
    {"char", FieldKind::kChar},
    {"int8", FieldKind::kInt8},
    {"uint8", FieldKind::kUint8},
    {"int16", FieldKind::kInt16},
    {"uint16", FieldKind::kUint16},
    {"int32", FieldKind::kInt32},
    {"uint32", FieldKind::kUint32},
    {"int64", FieldKind::kInt64},
    {"uint64", FieldKind::kUint64},
    {"float32", FieldKind::kFloat32},
    {"float64", FieldKind::kFloat64},
    {"string", FieldKind::kString},
    {"wstring", FieldKind::kWstring},
}};

std::string_view trim(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r";
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

/// The line up to a '#' that is not in quotes.
std::string_view without_comment(std::string_view line) {
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quote != 0 && c == '\\') {
      ++i;
    } else if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '#') {
      return line.substr(0, i);
    } else if (c == '"' || (c == '\'' && i > 0 && line[i - 1] == ' ')) {
      quote = c;
    }
  }
  return line;
}

bool is_identifier(std::string_view text) {
  const auto letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  return !text.empty() && (letter(text[0]) || text[0] == '_') &&
         std::all_of(text.begin(), text.end(), [&](char c) {
           return letter(c) || c == '_' || std::isdigit(static_cast<unsigned char>(c)) != 0;
         });
}

bool is_type_name(std::string_view text) {
  std::size_t parts = 0;
  while (true) {
    const std::size_t slash = text.find('/');
    if (!is_identifier(text.substr(0, slash)) || ++parts > 3) return false;
    if (slash == std::string_view::npos) return true;
    text.remove_prefix(slash + 1);
  }
}

std::optional<std::uint32_t> parse_size(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value == 0) return std::nullopt;
  return value;
}

/// Takes the "[...]" off the end of a type; false when it makes no sense.
bool take_array(std::string_view& type, Field& field) {
  if (type.empty() || type.back() != ']') return true;
  const std::size_t open = type.rfind('[');
  if (open == std::string_view::npos) return false;
  std::string_view inner = trim(type.substr(open + 1, type.size() - open - 2));
  type = type.substr(0, open);
  field.array = FieldArray::kUnbounded;
  if (inner.empty()) return true;
  field.array = inner.starts_with("<=") ? FieldArray::kBounded : FieldArray::kFixed;
  if (field.array == FieldArray::kBounded) inner.remove_prefix(2);
  const auto size = parse_size(inner);
  field.array_size = size.value_or(0);
  return size && (field.array == FieldArray::kBounded || *size <= kMaxArraySize);
}

/// Takes the "<=N" off the end of a string type.
bool take_string_capacity(std::string_view& type, Field& field) {
  const std::size_t bound = type.find("<=");
  if (bound == std::string_view::npos) return true;
  const auto size = parse_size(type.substr(bound + 2));
  type = type.substr(0, bound);
  field.string_capacity = size.value_or(0);
  return size && (type == "string" || type == "wstring");
}

bool parse_type(std::string_view type, const std::string& package, Field& field) {
  if (!take_array(type, field) || !take_string_capacity(type, field)) return false;
  const auto* kind = std::find_if(
      kKinds.begin(), kKinds.end(), [&](const auto& entry) { return entry.first == type; });
  if (kind != kKinds.end()) {
    field.kind = kind->second;
    return true;
  }
  field.kind = FieldKind::kMessage;
  const bool has_package = type.find('/') != std::string_view::npos;
  field.message_type =
      full_type_name(has_package ? std::string(type) : package + "/msg/" + std::string(type));
  return is_type_name(type);
}

std::string unquoted(std::string_view text) {
  if (text.size() < 2 || text.front() != text.back() ||
      (text.front() != '"' && text.front() != '\'')) {
    return std::string(text);
  }
  std::string out;
  text = text.substr(1, text.size() - 2);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escape = text[i] == '\\' && i + 1 < text.size() &&
                        std::string_view("\\\"'").find(text[i + 1]) != std::string_view::npos;
    out += text[escape ? ++i : i];
  }
  return out;
}

class Parser {
 public:
  explicit Parser(const std::string& root) : type_(full_type_name(root)) {}

  void run(const std::string& text) {
    std::istringstream lines(text);
    std::string line;
    begin();
    while (std::getline(lines, line)) {
      ++line_number_;
      const std::string_view trimmed = trim(line);
      if (trimmed.size() == 80 && trimmed.find_first_not_of('=') == std::string_view::npos) {
        end();
        expect_name_ = true;
      } else if (expect_name_) {
        parse_name(trimmed);
      } else {
        parse_line(line);
      }
    }
    end();
  }

  std::map<std::string, MessageDefinition> definitions;
  std::string problems;

 private:
  void problem(const std::string& what) {
    if (problems.size() < 4000) {
      problems += (problems.empty() ? "" : "\n") + std::string("line ") +
                  std::to_string(line_number_) + ": " + what;
    }
  }

  void begin() {
    current_ = MessageDefinition{type_, {}, {}};
    package_ = type_.substr(0, type_.find('/'));
    if (!is_type_name(type_) || type_.find('/') == std::string::npos) {
      problem("'" + type_ + "' is not the name of a message type (package/msg/Type)");
    }
  }

  /// rosbag2 repeats dependencies now and then; the first stays.
  void end() {
    if (!expect_name_) definitions.try_emplace(current_.type, std::move(current_));
  }

  void parse_name(std::string_view line) {
    if (line.empty()) return;
    expect_name_ = false;
    if (!line.starts_with("MSG:")) problem("expected 'MSG: package/Type' after the line of '='");
    type_ = full_type_name(std::string(trim(line.substr(std::min<std::size_t>(4, line.size())))));
    begin();
  }

  void parse_line(std::string_view full_line) {
    const std::string_view line = trim(without_comment(full_line));
    if (line.empty()) return;
    const std::size_t space = line.find_first_of(" \t");
    if (space == std::string_view::npos) return problem("'" + std::string(line) + "' has no name");
    Field field;
    if (!parse_type(line.substr(0, space), package_, field)) {
      return problem("'" + std::string(line.substr(0, space)) + "' is not a type");
    }
    const std::string_view rest = trim(line.substr(space));
    const std::size_t name_end = rest.find_first_of(" \t=");
    const std::string_view name = rest.substr(0, name_end);
    if (!is_identifier(name)) return problem("'" + std::string(name) + "' is not a name");
    const std::string_view value =
        name_end == std::string_view::npos ? std::string_view() : trim(rest.substr(name_end));
    if (value.starts_with('=')) {
      const bool is_string = field.kind == FieldKind::kString || field.kind == FieldKind::kWstring;
      const std::string_view text = trim(value.substr(1));
      current_.constants.push_back(
          {std::string(name), field.kind, is_string ? unquoted(text) : std::string(text)});
    } else {
      field.name = name;
      field.default_text = value;
      current_.fields.push_back(std::move(field));
    }
  }

  std::string type_;
  std::string package_;
  MessageDefinition current_;
  bool expect_name_ = false;
  int line_number_ = 0;
};

/// Fields whose type has only its last name may mean one in the same package, or, as in ROS 1, one
/// of std_msgs (`Header`); `time` and `duration` are messages too.
void resolve_names(std::map<std::string, MessageDefinition>& definitions) {
  for (auto& [type, definition] : definitions) {
    for (auto& field : definition.fields) {
      if (field.kind != FieldKind::kMessage || definitions.contains(field.message_type)) continue;
      const std::string name = field.message_type.substr(field.message_type.rfind('/'));
      if (name == "/Header" && definitions.contains("std_msgs/msg/Header")) {
        field.message_type = "std_msgs/msg/Header";
      }
    }
  }
}

using Definitions = std::map<std::string, MessageDefinition>;

/// Empty when the type and all below it are defined and do not nest themselves.
std::string check_nesting(const Definitions& definitions,
                          const std::string& type,
                          int depth,
                          std::map<std::string, int>& heights) {
  const auto it = definitions.find(type);
  if (it == definitions.end()) return "type " + type + " is used but not defined";
  if (depth > kMaxDepth) return "type " + type + " nests itself, or is nested too deep";
  if (heights.contains(type)) {
    return depth + heights[type] > kMaxDepth ? "type " + type + " is nested too deep" : "";
  }
  int height = 0;
  for (const auto& field : it->second.fields) {
    if (field.kind != FieldKind::kMessage) continue;
    auto problem = check_nesting(definitions, field.message_type, depth + 1, heights);
    if (!problem.empty()) return problem;
    height = std::max(height, heights[field.message_type] + 1);
  }
  heights[type] = height;
  return "";
}

}  // namespace

std::string full_type_name(const std::string& type) {
  const std::size_t slash = type.find('/');
  if (slash == std::string::npos || type.find('/', slash + 1) != std::string::npos) return type;
  return type.substr(0, slash) + "/msg" + type.substr(slash);
}

std::size_t size_of(FieldKind kind) {
  switch (kind) {
    case FieldKind::kBool:
    case FieldKind::kByte:
    case FieldKind::kChar:
    case FieldKind::kInt8:
    case FieldKind::kUint8:
      return 1;
    case FieldKind::kInt16:
    case FieldKind::kUint16:
      return 2;
    case FieldKind::kInt32:
    case FieldKind::kUint32:
    case FieldKind::kFloat32:
      return 4;
    case FieldKind::kInt64:
    case FieldKind::kUint64:
    case FieldKind::kFloat64:
      return 8;
    case FieldKind::kString:
    case FieldKind::kWstring:
    case FieldKind::kMessage:
      return 0;
  }
  return 0;
}

std::string to_string(FieldKind kind) {
  for (const auto& [word, known] : kKinds) {
    if (known == kind) return std::string(word);
  }
  return "message";
}

Result<MessageSchema> MessageSchema::parse(const std::string& type, const std::string& text) {
  const auto failed = [&](const std::string& what) {
    return Status(StatusCode::kCorrupt, "schema of " + type + ": " + what);
  };
  if (text.size() > kMaxTextSize) return failed("the text is too long");
  Parser parser(type);
  parser.run(text);
  if (!parser.problems.empty()) return failed(parser.problems);
  MessageSchema schema;
  schema.root_ = full_type_name(type);
  schema.definitions_ = std::move(parser.definitions);
  resolve_names(schema.definitions_);
  std::map<std::string, int> heights;
  const auto problem = check_nesting(schema.definitions_, schema.root_, 0, heights);
  if (!problem.empty()) return failed(problem);
  // What the root does not use is not checked, so it must not stay.
  std::erase_if(schema.definitions_,
                [&](const auto& entry) { return !heights.contains(entry.first); });
  return schema;
}

}  // namespace camvox::storage
