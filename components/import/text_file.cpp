#include "text_file.hpp"

#include <charconv>
#include <cmath>

#include "import_error.hpp"

namespace camvox::import {
namespace {

constexpr std::string_view kSpace = " \t\r\n\v\f";
constexpr std::size_t kMaxLine = 1U << 20;  // a binary file is not a text with one endless line

bool is_digits(std::string_view text) {
  return text.find_first_not_of("0123456789") == std::string_view::npos;
}

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

}  // namespace

TextFile::TextFile(std::filesystem::path path, char comma)
    : path_(std::move(path)), stream_(path_), comma_(comma) {
  if (!stream_ || std::filesystem::is_directory(path_)) {
    throw ImportError(storage::StatusCode::kIo, path_.string() + ": cannot be read");
  }
}

bool TextFile::next() {
  line_.clear();
  if (!std::getline(stream_, line_)) {
    if (stream_.bad()) throw ImportError(storage::StatusCode::kIo, path_.string() + ": read error");
    return false;
  }
  ++line_number_;
  if (line_.size() > kMaxLine) fail("the line is too long for a text file");
  while (!line_.empty() && line_.back() == '\r') line_.pop_back();
  split();
  return true;
}

void TextFile::split() {
  fields_.clear();
  std::string_view rest = trim(line_);
  if (comma_ != ' ') {
    while (!rest.empty()) {
      const auto end = std::min(rest.find(comma_), rest.size());
      fields_.push_back(trim(rest.substr(0, end)));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return;
  }
  while (!rest.empty()) {
    const auto end = std::min(rest.find_first_of(kSpace), rest.size());
    fields_.push_back(rest.substr(0, end));
    rest = trim(rest.substr(end));
  }
}

double TextFile::number(std::size_t field) const {
  if (field >= fields_.size()) {
    fail("has " + std::to_string(fields_.size()) + " fields, no field " +
         std::to_string(field + 1));
  }
  std::string_view text = fields_[field];
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    fail("'" + std::string(fields_[field].substr(0, 40)) + "' is not a number");
  }
  return value;
}

std::vector<double> TextFile::numbers(std::size_t first, std::size_t count) const {
  if (fields_.size() != first + count) {
    fail("expected " + std::to_string(first + count) + " fields, found " +
         std::to_string(fields_.size()));
  }
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(number(first + i));
  return values;
}

std::int64_t TextFile::seconds_as_ns(std::size_t field) const {
  const double rough = number(field);
  if (rough < 0.0 || rough > 9.2e9) fail("the time is out of range");
  const std::string_view text = fields_[field];
  const auto dot = std::min(text.find('.'), text.size());
  const auto whole = text.substr(0, dot);
  std::string fraction(text.substr(std::min(dot + 1, text.size())));
  if (!is_digits(whole) || !is_digits(fraction)) return std::llround(rough * 1e9);
  fraction.resize(9, '0');
  return (whole.empty() ? 0 : std::stoll(std::string(whole))) * 1'000'000'000 +
         std::stoll(fraction);
}

void TextFile::fail(const std::string& what) const {
  fail_corrupt(path_.string() + ":" + std::to_string(line_number_), what);
}

std::vector<std::uint8_t> read_bytes(const std::filesystem::path& path, std::uint64_t max_size) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  std::ifstream stream(path, std::ios::binary);
  if (error || !stream) {
    throw ImportError(storage::StatusCode::kIo, path.string() + ": cannot be read");
  }
  if (size > max_size) fail_corrupt(path, "is too large for what it should hold");
  std::vector<std::uint8_t> bytes(size);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (static_cast<std::uint64_t>(stream.gcount()) != size) fail_corrupt(path, "read error");
  return bytes;
}

}  // namespace camvox::import
