#include "camvox/features/corner_distribution.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace camvox::features {
namespace {

constexpr int kIndexBits = 32;
constexpr std::uint64_t kIndexMask = 0xffffffff;
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

void CornerDistribution::grow_tree(std::size_t corners, std::size_t leaves) {
  squares_.assign(1, {0, static_cast<std::uint32_t>(corners)});
  for (int bits = kCoordinateBits - 1; bits >= 0 && squares_.size() < leaves; --bits) {
    // Fullest first, so that the squares left whole when the tree is full hold the least.
    std::stable_sort(squares_.begin(), squares_.end(), [](const Square& a, const Square& b) {
      return a.count() > b.count();
    });
    next_.clear();
    for (std::size_t i = 0; i < squares_.size(); ++i) {
      const bool full = next_.size() + (squares_.size() - i) >= leaves;
      if (full || squares_[i].count() == 1) {
        next_.push_back(squares_[i]);
      } else {
        split(squares_[i], kIndexBits + 2 * bits, next_);
      }
    }
    squares_.swap(next_);
  }
}

void CornerDistribution::take_strongest(const std::vector<Corner>& corners, std::size_t count) {
  // Scores are bytes: count how many there are of each, from the top.
  std::array<std::size_t, 256> counts{};
  for (std::size_t i = 0; i < corners.size(); ++i) counts[taken_[i] != 0 ? 0 : corners[i].score]++;
  int weakest = 255;
  std::size_t above = 0;
  while (weakest > 1 && above + counts[static_cast<std::size_t>(weakest)] < count) {
    above += counts[static_cast<std::size_t>(weakest--)];
  }
  std::size_t of_weakest = count - above;
  for (const Key key : keys_) {
    const std::size_t i = key & kIndexMask;
    if (taken_[i] != 0 || corners[i].score < weakest) continue;
    if (corners[i].score == weakest && of_weakest == 0) continue;
    of_weakest -= corners[i].score == weakest ? 1 : 0;
    taken_[i] = 1;
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
  // The last split may give up to three leaves too many.
  const auto leaves = static_cast<std::size_t>(std::lround(even_share_ * wanted));
  grow_tree(corners.size(), std::max<std::size_t>(leaves, 4) - 3);
  taken_.assign(corners.size(), 0);
  std::size_t taken = 0;
  for (const Square& square : squares_) {
    std::size_t best = keys_[square.begin] & kIndexMask;
    for (std::uint32_t i = square.begin + 1; i < square.end; ++i) {
      const std::size_t index = keys_[i] & kIndexMask;
      if (corners[index].score > corners[best].score) best = index;
    }
    if (taken == static_cast<std::size_t>(wanted)) break;
    taken_[best] = 1;
    ++taken;
  }
  take_strongest(corners, static_cast<std::size_t>(wanted) - taken);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (taken_[i] != 0) chosen.push_back(corners[i]);
  }
}

}  // namespace camvox::features
