#pragma once

#include <bit>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "camvox/storage/byte_buffer.hpp"

namespace camvox::storage {

static_assert(std::endian::native == std::endian::little, "MCAP is little-endian; add swaps here");

/// Reads little-endian fields one after the other and never past the end. The first field that does
/// not fit makes the reader fail for good; from then on every field is zero or empty, so that a
/// caller checks `ok()` once, at the end.
class ByteReader {
 public:
  explicit ByteReader(Bytes bytes) : bytes_(bytes) {}

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - position_; }
  void fail() { ok_ = false; }

  template <typename T>
  [[nodiscard]] T number() {
    T value{};
    const Bytes raw = take(sizeof(T));
    if (raw.size() == sizeof(T)) std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }

  /// The next `size` bytes, or none when there are fewer.
  [[nodiscard]] Bytes take(std::uint64_t size) {
    if (!ok_ || size > remaining()) {
      ok_ = false;
      return {};
    }
    const Bytes taken = bytes_.subspan(position_, static_cast<std::size_t>(size));
    position_ += taken.size();
    return taken;
  }

  [[nodiscard]] Bytes rest() { return take(remaining()); }
  [[nodiscard]] Bytes bytes32() { return take(number<std::uint32_t>()); }
  [[nodiscard]] Bytes bytes64() { return take(number<std::uint64_t>()); }
  [[nodiscard]] std::string string() { return std::string(as_text(bytes32())); }

  /// Map of strings; its length is in bytes.
  [[nodiscard]] std::map<std::string, std::string> string_map() {
    std::map<std::string, std::string> map;
    ByteReader entries(bytes32());
    while (entries.ok() && entries.remaining() > 0) {
      std::string key = entries.string();
      map[std::move(key)] = entries.string();
    }
    ok_ = ok_ && entries.ok();
    return map;
  }

  /// Array (or map) of pairs of numbers; its length is in bytes.
  template <typename A, typename B>
  [[nodiscard]] std::vector<std::pair<A, B>> pairs() {
    ByteReader entries(bytes32());
    std::vector<std::pair<A, B>> result;
    result.reserve(entries.remaining() / (sizeof(A) + sizeof(B)));
    while (entries.ok() && entries.remaining() > 0) {
      const A first = entries.number<A>();
      const B second = entries.number<B>();
      if (entries.ok()) result.emplace_back(first, second);
    }
    ok_ = ok_ && entries.ok();
    return result;
  }

 private:
  Bytes bytes_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

/// Appends little-endian fields to a buffer.
class ByteWriter {
 public:
  explicit ByteWriter(ByteBuffer& out) : out_(out) {}

  template <typename T>
  void number(T value) {
    out_.append(std::as_bytes(std::span(&value, 1)));
  }
  void bytes(Bytes value) { out_.append(value); }
  void bytes32(Bytes value) {
    number(static_cast<std::uint32_t>(value.size()));
    out_.append(value);
  }
  void string(std::string_view text) { bytes32(as_bytes(text)); }

  void string_map(const std::map<std::string, std::string>& map) {
    const std::size_t start = begin_block();
    for (const auto& [key, value] : map) {
      string(key);
      string(value);
    }
    end_block(start);
  }

  template <typename A, typename B>
  void pairs(const std::vector<std::pair<A, B>>& values) {
    const std::size_t start = begin_block();
    for (const auto& [first, second] : values) {
      number(first);
      number(second);
    }
    end_block(start);
  }

 private:
  [[nodiscard]] std::size_t begin_block() {
    number(std::uint32_t{0});
    return out_.size();
  }
  void end_block(std::size_t start) {
    const auto size = static_cast<std::uint32_t>(out_.size() - start);
    std::memcpy(out_.data() + start - sizeof(size), &size, sizeof(size));
  }

  ByteBuffer& out_;
};

}  // namespace camvox::storage
