#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace camvox::simulation {

/// The finaliser of splitmix64 (Steele, Lea & Flood, OOPSLA 2014): a bijection of 64 bits whose
/// output bits all depend on all input bits.
[[nodiscard]] constexpr std::uint64_t mix_bits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// Random numbers by counter: sample `index` of a stream is a pure function of (seed, stream,
/// index, channel). So it does not matter in which order, or by which thread, samples are made.
class CounterRandom {
 public:
  CounterRandom(std::uint64_t seed, std::uint64_t stream)
      : key_(mix_bits(seed ^ mix_bits(stream))) {}

  [[nodiscard]] std::uint64_t bits(std::uint64_t index, std::uint64_t channel = 0) const {
    return mix_bits(mix_bits(key_ ^ index) + channel * 0xd1342543de82ef95ULL);
  }

  /// Uniform in [0, 1), 53 bits.
  [[nodiscard]] double uniform(std::uint64_t index, std::uint64_t channel = 0) const {
    return static_cast<double>(bits(index, channel) >> 11) * 0x1.0p-53;
  }

  /// Uniform in [low, high).
  [[nodiscard]] double between(double low,
                               double high,
                               std::uint64_t index,
                               std::uint64_t channel = 0) const {
    return low + (high - low) * uniform(index, channel);
  }

  /// Standard normal (Box & Muller); channels 2c and 2c + 1 of `bits` are used.
  [[nodiscard]] double normal(std::uint64_t index, std::uint64_t channel = 0) const {
    const double radius = std::sqrt(-2.0 * std::log1p(-uniform(index, 2 * channel)));
    return radius * std::cos(2.0 * std::numbers::pi * uniform(index, 2 * channel + 1));
  }

  /// Nearly normal, unit variance, never beyond 3.47 sigma: the sum of four uniforms. For
  /// pixels, where the logarithm of the true normal would cost more than the rendering.
  [[nodiscard]] float fast_normal(std::uint64_t index, std::uint64_t channel = 0) const {
    const std::uint64_t b = bits(index, channel);
    const auto sum =
        static_cast<float>((b & 0xffff) + ((b >> 16) & 0xffff) + ((b >> 32) & 0xffff) + (b >> 48));
    return (sum - 2.0f * 65535.0f) * (1.7320508f / 65536.0f);
  }

 private:
  std::uint64_t key_;
};

/// Draws one number after another from a stream, for building worlds in program order.
class SequentialRandom {
 public:
  SequentialRandom(std::uint64_t seed, std::uint64_t stream) : random_(seed, stream) {}

  [[nodiscard]] double between(double low, double high) {
    return random_.between(low, high, next_++);
  }
  [[nodiscard]] float between(float low, float high) {
    return static_cast<float>(random_.between(low, high, next_++));
  }
  /// Uniform among 0 ... count - 1.
  [[nodiscard]] int below(int count) {
    return static_cast<int>(random_.uniform(next_++) * static_cast<double>(count));
  }
  [[nodiscard]] bool chance(double probability) { return random_.uniform(next_++) < probability; }

 private:
  CounterRandom random_;
  std::uint64_t next_ = 0;
};

}  // namespace camvox::simulation
