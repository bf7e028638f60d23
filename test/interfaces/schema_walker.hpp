#pragma once

#include <cstdint>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

/// Reads CDR by nothing but the ROS 2 schema text, as a foreign tool would.
namespace camvox::interfaces {

class SchemaWalker {
 public:
  SchemaWalker(std::string_view schema, const std::vector<std::uint8_t>& cdr) : cdr_(cdr) {
    std::string message;  // "" is the outermost one
    std::istringstream lines{std::string(schema)};
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("MSG: ")) message = line.substr(line.rfind('/') + 1);
      fields_[message].push_back(line);
    }
  }

  /// "" if the bytes are one message, without a byte to spare; else what is wrong.
  std::string walk() {
    read_message("");
    if (problem_.empty() && position_ != cdr_.size()) problem_ = "bytes left over";
    return problem_;
  }

 private:
  void read_message(const std::string& name) {
    static const std::regex kField(R"(^(\w+)(?:\[(<=)?(\d+)\])? (\w+).*)");
    for (const auto& line : fields_.at(name)) {
      std::smatch field;
      if (!std::regex_match(line, field, kField) || !problem_.empty()) continue;
      std::uint32_t count = field[3].matched ? static_cast<std::uint32_t>(std::stoul(field[3])) : 1;
      if (field[2].matched) {
        const std::uint32_t bound = count;
        count = read_length();
        if (count > bound) problem_ = field[4].str() + ": longer than its bound";
      }
      read_elements(field[1], count);
    }
  }

  void read_elements(const std::string& type, std::uint32_t count) {
    static const std::map<std::string, std::size_t> kSizes = {{"uint8", 1},
                                                              {"int32", 4},
                                                              {"uint32", 4},
                                                              {"int64", 8},
                                                              {"uint64", 8},
                                                              {"float32", 4},
                                                              {"float64", 8}};
    const auto size = kSizes.find(type);
    if (size == kSizes.end()) return read_message(type);
    if (count > 0) skip(size->second, count);
  }

  std::uint32_t read_length() {
    skip(4, 1);
    if (!problem_.empty()) return 0;
    std::uint32_t length = 0;
    for (int i = 0; i < 4; ++i) {
      length |= std::uint32_t{cdr_[position_ - 4 + static_cast<std::size_t>(i)]} << (8 * i);
    }
    return length;
  }

  void skip(std::size_t size, std::size_t count) {
    const std::size_t body = position_ - kEncapsulationBytes;
    position_ = kEncapsulationBytes + (body + size - 1) / size * size + size * count;
    if (position_ > cdr_.size()) problem_ = "ends early";
  }

  static constexpr std::size_t kEncapsulationBytes = 4;
  const std::vector<std::uint8_t>& cdr_;
  std::map<std::string, std::vector<std::string>> fields_;
  std::size_t position_ = kEncapsulationBytes;
  std::string problem_;
};

inline std::string walk_schema(std::string_view schema, const std::vector<std::uint8_t>& cdr) {
  return SchemaWalker(schema, cdr).walk();
}

}  // namespace camvox::interfaces
