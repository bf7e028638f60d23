#pragma once

#include <cstring>
#include <memory>
#include <random>
#include <type_traits>
#include <vector>

#include "camvox/interfaces/camvox_interfaces.hpp"

/// Random plain messages, and what of them is in use. Written against PlainLayout only, so that it
/// judges the codec from outside.
namespace camvox::test {

/// Element type of a (nested) array.
template <typename T>
struct ElementOf {
  using type = T;
};
template <typename T, std::size_t N>
struct ElementOf<std::array<T, N>> : ElementOf<T> {};

/// Random bytes everywhere, and for each list a random count up to `largest_count`.
class RandomFill {
 public:
  RandomFill(std::mt19937& random, std::uint32_t largest_count)
      : random_(random), largest_count_(largest_count) {}

  template <typename Member>
  void fixed(Member& member) {
    if constexpr (std::is_arithmetic_v<typename ElementOf<Member>::type>) {
      fill(&member, sizeof(member));
    } else {
      interfaces::PlainLayout<Member>::visit(member, *this);
    }
  }
  template <typename Array>
  void list(Array& array, std::uint32_t& count) {
    const auto capacity = static_cast<std::uint32_t>(array.size());
    count = std::uniform_int_distribution<std::uint32_t>(
        0, std::min(capacity, largest_count_))(random_);
    if (exact_) count = std::min(capacity, largest_count_);
    fill(array.data(), count * sizeof(array[0]));
  }
  /// Every list gets exactly `largest_count` rows, or its capacity.
  RandomFill& exact() {
    exact_ = true;
    return *this;
  }

 private:
  void fill(void* target, std::size_t bytes) {
    auto* out = static_cast<std::uint8_t*>(target);
    for (std::size_t i = 0; i < bytes; ++i) out[i] = static_cast<std::uint8_t>(random_());
  }

  std::mt19937& random_;
  std::uint32_t largest_count_;
  bool exact_ = false;
};

/// All bytes that belong to the message: fixed members, counts, counted rows.
class UsedBytes {
 public:
  template <typename Member>
  void fixed(Member& member) {
    if constexpr (std::is_arithmetic_v<typename ElementOf<Member>::type>) {
      append(&member, sizeof(member));
    } else {
      interfaces::PlainLayout<Member>::visit(member, *this);
    }
  }
  template <typename Array>
  void list(Array& array, std::uint32_t& count) {
    append(&count, sizeof(count));
    append(array.data(), count * sizeof(array[0]));
  }
  std::vector<std::uint8_t> bytes;

 private:
  void append(const void* data, std::size_t size) {
    const auto* begin = static_cast<const std::uint8_t*>(data);
    bytes.insert(bytes.end(), begin, begin + size);
  }
};

template <typename T>
std::vector<std::uint8_t> used_bytes(T& message) {
  UsedBytes used;
  interfaces::PlainLayout<T>::visit(message, used);
  return std::move(used.bytes);
}

/// A message whose every byte is junk but for what `reset` clears.
template <typename T>
std::unique_ptr<T> unclean_message() {
  auto message = std::make_unique<T>();
  std::memset(static_cast<void*>(message.get()), 0xA5, sizeof(T));
  interfaces::message_type<T>().reset(message.get());
  return message;
}

template <typename T>
std::unique_ptr<T> random_message(std::mt19937& random, std::uint32_t largest_count) {
  auto message = unclean_message<T>();
  interfaces::PlainLayout<T>::visit(*message, RandomFill(random, largest_count));
  return message;
}

/// Every list with exactly that many rows, or as many as it can hold.
template <typename T>
std::unique_ptr<T> full_message(std::mt19937& random, std::uint32_t count) {
  auto message = unclean_message<T>();
  interfaces::PlainLayout<T>::visit(*message, RandomFill(random, count).exact());
  return message;
}

}  // namespace camvox::test
