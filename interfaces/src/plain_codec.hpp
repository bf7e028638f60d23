#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "camvox/interfaces/plain_layout.hpp"

/// Plain messages to and from CDR, and copies of their used part. One visitor a job; the order of
/// the members comes from the generated PlainLayout.
namespace camvox::interfaces::internal {

/// The arithmetic type that a (nested) array is made of, and how many there are.
template <typename T>
struct Flat {
  using Element = T;
  static constexpr std::size_t kCount = 1;
};
template <typename T, std::size_t N>
struct Flat<std::array<T, N>> {
  using Element = typename Flat<T>::Element;
  static constexpr std::size_t kCount = N * Flat<T>::kCount;
};

template <typename T>
inline constexpr bool kIsPrimitive =
    std::is_arithmetic_v<typename Flat<std::remove_const_t<T>>::Element>;

/// Base of the visitors: primitives go to `Derived::primitives`, nested structs are descended.
template <typename Derived>
struct LayoutVisitor {
  template <typename Member>
  void fixed(Member& member) {
    using Plain = std::remove_const_t<Member>;
    if constexpr (kIsPrimitive<Plain>) {
      using Flattened = Flat<Plain>;
      self().template primitives<typename Flattened::Element>(&member, Flattened::kCount);
    } else {
      PlainLayout<Plain>::visit(member, self());
    }
  }
  Derived& self() { return static_cast<Derived&>(*this); }
};

/// Bytes of the CDR form, without the encapsulation.
struct CdrSize : LayoutVisitor<CdrSize> {
  std::size_t bytes = 0;

  template <typename Element>
  void primitives(const void*, std::size_t count) {
    if (count == 0) return;
    bytes = (bytes + sizeof(Element) - 1) / sizeof(Element) * sizeof(Element);
    bytes += count * sizeof(Element);
  }
  template <typename Array>
  void list(const Array& array, std::uint32_t count) {
    using Row = Flat<typename Array::value_type>;
    primitives<std::uint32_t>(nullptr, 1);
    primitives<typename Row::Element>(array.data(), count * Row::kCount);
  }
};

/// Writes the CDR form; the buffer must hold CdrSize bytes.
class CdrWriter : public LayoutVisitor<CdrWriter> {
 public:
  explicit CdrWriter(std::uint8_t* buffer) : buffer_(buffer) {}

  template <typename Element>
  void primitives(const void* source, std::size_t count) {
    if (count == 0) return;
    while (position_ % sizeof(Element) != 0) buffer_[position_++] = 0;
    std::memcpy(buffer_ + position_, source, count * sizeof(Element));
    position_ += count * sizeof(Element);
  }
  template <typename Array>
  void list(const Array& array, std::uint32_t count) {
    using Row = Flat<typename Array::value_type>;
    const auto elements = static_cast<std::uint32_t>(count * Row::kCount);
    primitives<std::uint32_t>(&elements, 1);
    primitives<typename Row::Element>(array.data(), elements);
  }

 private:
  std::uint8_t* buffer_;
  std::size_t position_ = 0;
};

/// Reads the CDR form into a message; `ok()` is false once data were short or over capacity.
class CdrReader : public LayoutVisitor<CdrReader> {
 public:
  CdrReader(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  [[nodiscard]] bool ok() const { return ok_; }

  template <typename Element>
  void primitives(void* target, std::size_t count) {
    if (!ok_ || count == 0) return;
    const std::size_t start = (position_ + sizeof(Element) - 1) / sizeof(Element) * sizeof(Element);
    const std::size_t bytes = count * sizeof(Element);
    if (start > size_ || bytes > size_ - start) {
      ok_ = false;
      return;
    }
    std::memcpy(target, data_ + start, bytes);
    position_ = start + bytes;
  }
  template <typename Array>
  void list(Array& array, std::uint32_t& count) {
    using Row = Flat<typename Array::value_type>;
    std::uint32_t elements = 0;
    primitives<std::uint32_t>(&elements, 1);
    const std::size_t rows = elements / Row::kCount;
    ok_ = ok_ && elements % Row::kCount == 0 && rows <= array.size();
    count = ok_ ? static_cast<std::uint32_t>(rows) : 0;
    primitives<typename Row::Element>(array.data(), ok_ ? elements : 0);
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

/// Zeroes what is always used, and the counters.
struct Clear : LayoutVisitor<Clear> {
  template <typename Element>
  void primitives(void* target, std::size_t count) {
    std::memset(target, 0, count * sizeof(Element));
  }
  template <typename Array>
  void list(Array&, std::uint32_t& count) {
    count = 0;
  }
};

/// Checks every counter against the capacity of its list.
struct CounterCheck : LayoutVisitor<CounterCheck> {
  bool valid = true;

  template <typename Element>
  void primitives(const void*, std::size_t) {}
  template <typename Array>
  void list(const Array& array, std::uint32_t count) {
    valid = valid && count <= array.size();
  }
};

/// Copies the used part. Offsets are equal in both messages, so addresses carry over.
class UsedPartCopy : public LayoutVisitor<UsedPartCopy> {
 public:
  UsedPartCopy(const void* from, void* to)
      : from_(static_cast<const std::uint8_t*>(from)), to_(static_cast<std::uint8_t*>(to)) {}

  template <typename Element>
  void primitives(const void* source, std::size_t count) {
    copy(source, count * sizeof(Element));
  }
  template <typename Array>
  void list(const Array& array, const std::uint32_t& count) {
    copy(&count, sizeof(count));
    copy(array.data(), count * sizeof(typename Array::value_type));
  }

 private:
  void copy(const void* source, std::size_t bytes) {
    const auto offset = static_cast<const std::uint8_t*>(source) - from_;
    std::memcpy(to_ + offset, source, bytes);
  }

  const std::uint8_t* from_;
  std::uint8_t* to_;
};

}  // namespace camvox::interfaces::internal
