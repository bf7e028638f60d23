#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "camvox/storage/byte_io.hpp"

namespace camvox::mapping {

/// CDR (XCDR1, little-endian): each number is aligned to its size, counted from behind the head.
inline constexpr std::size_t kCdrHeadSize = 4;

class CdrWriter {
 public:
  /// Replaces the content of `out`.
  explicit CdrWriter(storage::ByteBuffer& out) : out_(out) {
    out_.clear();
    append(std::uint32_t{0x0100});  // 00 01 00 00: plain CDR, little-endian
  }

  template <typename T>
  void number(T value) {
    align(sizeof(T));
    append(value);
  }
  /// Fixed length.
  template <typename T, std::size_t kExtent>
  void array(std::span<const T, kExtent> values) {
    align(sizeof(T));
    out_.append(std::as_bytes(values));
  }
  template <typename T>
  void sequence(const std::vector<T>& values) {
    number(static_cast<std::uint32_t>(values.size()));
    array(std::span(values));
  }

 private:
  template <typename T>
  void append(T value) {
    out_.append(std::as_bytes(std::span(&value, 1)));
  }
  void align(std::size_t size) {
    while ((out_.size() - kCdrHeadSize) % size != 0) append(std::uint8_t{0});
  }

  storage::ByteBuffer& out_;
};

/// Never reads past the end and never allocates more than there is; see ByteReader for errors.
class CdrReader {
 public:
  explicit CdrReader(storage::Bytes message) : fields_(message) {
    if (fields_.number<std::uint32_t>() != 0x0100) fields_.fail();
  }

  [[nodiscard]] bool ok() const { return fields_.ok(); }
  /// All is read, and nothing is left.
  [[nodiscard]] bool complete() const { return fields_.ok() && fields_.remaining() == 0; }

  template <typename T>
  [[nodiscard]] T number() {
    align(sizeof(T));
    return fields_.number<T>();
  }
  template <typename T, std::size_t kSize>
  [[nodiscard]] std::array<T, kSize> array() {
    std::array<T, kSize> values{};
    align(sizeof(T));
    copy(fields_.take(sizeof(values)), values.data());
    return values;
  }
  template <typename T>
  [[nodiscard]] std::vector<T> sequence() {
    const std::uint64_t count = number<std::uint32_t>();
    align(sizeof(T));
    const auto bytes = fields_.take(count * sizeof(T));
    std::vector<T> values(bytes.size() / sizeof(T));
    copy(bytes, values.data());
    return values;
  }

 private:
  static void copy(storage::Bytes bytes, void* to) {
    if (!bytes.empty()) std::memcpy(to, bytes.data(), bytes.size());
  }
  void align(std::size_t size) {
    const std::size_t behind_head = fields_.position() - kCdrHeadSize;
    if (fields_.ok()) (void)fields_.take((size - behind_head % size) % size);
  }

  storage::ByteReader fields_;
};

}  // namespace camvox::mapping
