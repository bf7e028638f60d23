#include <charconv>
#include <cmath>

#include "camvox/storage/cdr_value.hpp"
#include "camvox/storage/yaml_text.hpp"

namespace camvox::storage {
namespace {

/// As Python's repr: the shortest text that reads back as the same number, with a point.
template <typename T>
std::string real_text(T value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value < 0 ? "-.inf" : ".inf";
  char buffer[64];
  const double magnitude = std::abs(static_cast<double>(value));
  const bool plain = magnitude == 0.0 || (magnitude >= 1e-4 && magnitude < 1e16);
  const auto format = plain ? std::chars_format::fixed : std::chars_format::scientific;
  const auto result = std::to_chars(std::begin(buffer), std::end(buffer), value, format);
  std::string text(std::begin(buffer), result.ptr);
  // YAML 1.1 takes "1e-07" for a string, so it needs the point too.
  if (text.find('.') == std::string::npos) {
    text.insert(std::min(text.find('e'), text.size()), ".0");
  }
  return text;
}

class YamlPrinter {
 public:
  explicit YamlPrinter(const YamlStyle& style) : style_(style) {}

  std::string run(const CdrValue& value) {
    if (const auto* members = std::get_if<CdrMembers>(&value.data)) {
      print_members(*members, 0);
    } else {
      print_value(value, 0);
    }
    if (!out_.empty() && out_.front() == ' ') out_.erase(0, 1);
    if (!out_.empty() && out_.front() == '\n') out_.erase(0, 1);
    return std::move(out_);
  }

 private:
  void indent(std::size_t depth) { out_.append(depth * 2, ' '); }

  void print_members(const CdrMembers& members, std::size_t depth) {
    bool first = true;
    for (const auto& member : members) {
      if (!(first && in_item_)) indent(depth);
      first = false;
      in_item_ = false;
      out_ += member.name + ":";
      print_value(member.value, depth + 1);
    }
  }

  /// Behind "name:" or "-"; ends with a new line.
  void print_value(const CdrValue& value, std::size_t depth) {
    if (const auto* members = std::get_if<CdrMembers>(&value.data)) {
      out_ += members->empty() ? " {}\n" : "\n";
      print_members(*members, depth);
    } else if (const auto* array = std::get_if<CdrArray>(&value.data)) {
      print_sequence(array->size(), to_string(array->kind), depth, [&](std::size_t i) {
        return array->element(i);
      });
    } else if (const auto* list = std::get_if<CdrList>(&value.data)) {
      print_sequence(list->size(), "message", depth, [&](std::size_t i) -> const CdrValue& {
        return (*list)[i];
      });
    } else {
      out_ += " " + scalar_text(value) + "\n";
    }
  }

  template <typename Get>
  void print_sequence(std::size_t size,
                      const std::string& type,
                      std::size_t depth,
                      const Get& element) {
    if (style_.hide_arrays) {
      out_ += " '<sequence type: " + type + ", length: " + std::to_string(size) + ">'\n";
      return;
    }
    if (size == 0) {
      out_ += " []\n";
      return;
    }
    const std::size_t shown = std::min(size, style_.max_array_length);
    if (style_.flow && type != "message") {
      print_flow(size, shown, element);
      return;
    }
    out_ += "\n";
    // Items stand under the name of their field, as PyYAML puts them.
    const std::size_t item_depth = depth == 0 ? 0 : depth - 1;
    for (std::size_t i = 0; i < shown; ++i) print_item(element(i), item_depth);
    if (shown < size) {
      indent(item_depth);
      out_ += "- '...'\n";
    }
  }

  template <typename Get>
  void print_flow(std::size_t size, std::size_t shown, const Get& element) {
    out_ += " [";
    for (std::size_t i = 0; i < shown; ++i) {
      if (i > 0) out_ += ", ";
      out_ += scalar_text(element(i));
    }
    out_ += shown < size ? ", '...']\n" : "]\n";
  }

  void print_item(const CdrValue& value, std::size_t depth) {
    indent(depth);
    out_ += "-";
    const auto* members = std::get_if<CdrMembers>(&value.data);
    if (members != nullptr && !members->empty()) {
      out_ += " ";
      in_item_ = true;
      print_members(*members, depth + 1);
    } else {
      print_value(value, depth + 1);
    }
  }

  [[nodiscard]] std::string scalar_text(const CdrValue& value) const {
    if (const auto* v = std::get_if<bool>(&value.data)) return *v ? "true" : "false";
    if (const auto* v = std::get_if<std::int64_t>(&value.data)) return std::to_string(*v);
    if (const auto* v = std::get_if<std::uint64_t>(&value.data)) return std::to_string(*v);
    if (const auto* v = std::get_if<float>(&value.data)) return real_text(*v);
    if (const auto* v = std::get_if<double>(&value.data)) return real_text(*v);
    if (const auto* v = std::get_if<std::string>(&value.data)) return string_text(*v);
    return "null";
  }

  [[nodiscard]] std::string string_text(const std::string& text) const {
    if (style_.hide_strings) {
      return "'<string length: <" + std::to_string(text.size()) + ">>'";
    }
    if (text.size() <= style_.max_array_length) return yaml_string(text);
    return yaml_string(text.substr(0, style_.max_array_length) + "...");
  }

  const YamlStyle& style_;
  std::string out_;
  bool in_item_ = false;  ///< The first member goes behind the "- ".
};

}  // namespace

std::string to_yaml(const CdrValue& value, const YamlStyle& style) {
  return YamlPrinter(style).run(value);
}

}  // namespace camvox::storage
