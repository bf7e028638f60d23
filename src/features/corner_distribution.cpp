#include "camvox/features/corner_distribution.hpp"

#include <algorithm>
#include <array>

namespace camvox::features {
namespace {

constexpr int kIndexBits = 32;
constexpr int kCoordinateBits = 16;

/// Puts a zero bit before each bit of a 16-bit number.
std::uint32_t spread_bits(std::uint32_t value) {
  value = (value | value << 8) & 0x00ff00ff;
  value = (value | value << 4) & 0x0f0f0f0f;
  value = (value | value << 2) & 0x33333333;
  return (value | value << 1) & 0x55555555;
}

}  // namespace

void CornerDistribution::sort_along_curve(const std::vector<Corner>& corners) {
  keys_.clear();
  Key used = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Key place = spread_bits(corners[i].u_px) | spread_bits(corners[i].v_px) << 1;
    used |= place;
    keys_.push_back(place << kIndexBits | i);
  }
  scratch_.resize(keys_.size());
  constexpr int kDigitBits = 11;
  for (int shift = 0; used >> shift != 0; shift += kDigitBits) {
    std::array<std::uint32_t, (1 << kDigitBits) + 1> starts{};
    const auto digit = [&](Key key) {
      return static_cast<std::size_t>(key >> (kIndexBits + shift)) & ((1U << kDigitBits) - 1);
    };
    for (const Key key : keys_) ++starts[digit(key) + 1];
    for (std::size_t i = 1; i < starts.size(); ++i) starts[i] += starts[i - 1];
    for (const Key key : keys_) scratch_[starts[digit(key)]++] = key;
    keys_.swap(scratch_);
  }
}

void CornerDistribution::split(const Square& square,
                               int shift,
                               std::vector<Square>& children) const {
  const auto last = keys_.begin() + square.end;
  auto first = keys_.begin() + square.begin;
  while (first != last) {
    const Key quarter = *first >> shift;
    const auto next =
        std::partition_point(first, last, [&](Key key) { return key >> shift == quarter; });
    children.push_back({static_cast<std::uint32_t>(first - keys_.begin()),
                        static_cast<std::uint32_t>(next - keys_.begin())});
    first = next;
  }
}

void CornerDistribution::choose(const std::vector<Corner>& corners,
                                int wanted,
                                std::vector<Corner>& chosen) {
  chosen.clear();
  if (wanted <= 0) return;
  if (corners.size() <= static_cast<std::size_t>(wanted)) {
    chosen = corners;
    return;
  }
  sort_along_curve(corners);
  squares_.assign(1, {0, static_cast<std::uint32_t>(corners.size())});
  const auto limit = static_cast<std::size_t>(wanted);
  for (int bits = kCoordinateBits - 1; bits >= 0 && squares_.size() < limit; --bits) {
    // Fullest first, so that the squares left whole when the limit is reached hold the least.
    std::stable_sort(squares_.begin(), squares_.end(), [](const Square& a, const Square& b) {
      return a.count() > b.count();
    });
    next_.clear();
    for (std::size_t i = 0; i < squares_.size(); ++i) {
      const bool full = next_.size() + (squares_.size() - i) >= limit;
      if (full || squares_[i].count() == 1) {
        next_.push_back(squares_[i]);
      } else {
        split(squares_[i], kIndexBits + 2 * bits, next_);
      }
    }
    squares_.swap(next_);
  }
  for (const Square& square : squares_) {
    const Corner* best = nullptr;
    for (std::uint32_t i = square.begin; i < square.end; ++i) {
      const Corner& corner = corners[keys_[i] & 0xffffffff];
      if (best == nullptr || corner.score > best->score) best = &corner;
    }
    chosen.push_back(*best);
  }
  if (chosen.size() > limit) {  // the last split gave up to three too many
    std::stable_sort(chosen.begin(), chosen.end(), [](const Corner& a, const Corner& b) {
      return a.score > b.score;
    });
    chosen.resize(limit);
  }
  std::sort(chosen.begin(), chosen.end(), [](const Corner& a, const Corner& b) {
    return a.v_px != b.v_px ? a.v_px < b.v_px : a.u_px < b.u_px;
  });
}

}  // namespace camvox::features
