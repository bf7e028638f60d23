#include "camvox/storage/yaml_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>

namespace camvox::storage {
namespace {

bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 || byte == 0x7F;
}

/// Length of the UTF-8 sequence at the start of the text, 0 when it is none.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  const std::size_t length = first < 0x80   ? 1
                             : first < 0xC2 ? 0
                             : first < 0xE0 ? 2
                             : first < 0xF0 ? 3
                             : first < 0xF5 ? 4
                                            : 0;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
  }
  return length;
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

/// Words that YAML 1.1 or 1.2 readers take for booleans or null, in any case.
bool is_reserved_word(std::string_view text) {
  static constexpr std::array<std::string_view, 10> kWords = {
      "true", "false", "yes", "no", "on", "off", "y", "n", "null", "nan"};
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return std::find(kWords.begin(), kWords.end(), lower) != kWords.end();
}

bool is_plain(std::string_view text) {
  const auto letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  const auto allowed = [&](char c) {
    return letter(c) || std::isdigit(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_/.- ()+=").find(c) != std::string_view::npos;
  };
  return !text.empty() && (letter(text.front()) || text.front() == '/' || text.front() == '_') &&
         text.back() != ' ' && std::all_of(text.begin(), text.end(), allowed) &&
         !is_reserved_word(text);
}

void append_escaped(char c, std::string& out) {
  static constexpr char kDigits[] = "0123456789abcdef";
  const auto byte = static_cast<unsigned char>(c);
  switch (c) {
    case '\n':
      out += "\\n";
      return;
    case '\t':
      out += "\\t";
      return;
    case '"':
    case '\\':
      out += '\\';
      out += c;
      return;
    default:
      out += "\\x";
      out += kDigits[byte >> 4U];
      out += kDigits[byte & 0xFU];
  }
}

}  // namespace

std::string yaml_quoted(std::string_view text) {
  std::string out = "\"";
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const char c = text.front();
    const bool verbatim = length > 0 && !is_control(c) && c != '"' && c != '\\';
    if (verbatim) {
      out += text.substr(0, length);
    } else {
      append_escaped(c, out);
    }
    text.remove_prefix(verbatim ? length : 1);
  }
  return out + "\"";
}

std::string yaml_string(std::string_view text) {
  if (is_plain(text)) return std::string(text);
  if (std::any_of(text.begin(), text.end(), is_control) || !is_utf8(text)) return yaml_quoted(text);
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'') out += '\'';
    out += c;
  }
  return out + "'";
}

}  // namespace camvox::storage
