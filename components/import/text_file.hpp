#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace camvox::import {

/// Reads a text file line by line as fields; what is wrong is reported with file and line.
class TextFile {
 public:
  /// White space separates fields; with a `comma` only that does, and empty fields count, except
  /// for one after the last comma.
  explicit TextFile(std::filesystem::path path, char comma = ' ');

  /// Goes to the next line; false at the end. Carriage returns are dropped.
  bool next();

  [[nodiscard]] const std::string& line() const { return line_; }
  [[nodiscard]] const std::vector<std::string_view>& fields() const { return fields_; }
  /// Blank, or a comment that begins with '#'.
  [[nodiscard]] bool empty_line() const { return fields_.empty() || fields_[0].starts_with('#'); }

  /// A finite number; an error if the field is not there or is none.
  [[nodiscard]] double number(std::size_t field) const;
  /// All fields from `first` on, which must be `count`.
  [[nodiscard]] std::vector<double> numbers(std::size_t first, std::size_t count) const;
  /// Decimal seconds as nanoseconds, exactly: a double would lose the last 100 ns of today's time.
  [[nodiscard]] std::int64_t seconds_as_ns(std::size_t field) const;

  /// Ends the import with "file:line: what".
  [[noreturn]] void fail(const std::string& what) const;

 private:
  void split();

  std::filesystem::path path_;
  std::ifstream stream_;
  char comma_;
  std::string line_;
  std::vector<std::string_view> fields_;
  std::size_t line_number_ = 0;
};

/// The bytes of a file; an error if it cannot be read or is larger than `max_size`.
[[nodiscard]] std::vector<std::uint8_t> read_bytes(const std::filesystem::path& path,
                                                   std::uint64_t max_size = 256U << 20);

}  // namespace camvox::import
