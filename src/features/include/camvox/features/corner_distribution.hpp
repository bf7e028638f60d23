#pragma once

#include <cstdint>
#include <vector>

#include "camvox/features/corner_detector.hpp"

namespace camvox::features {

/// Chooses corners spread evenly over the image: a quad tree is split, fullest squares first,
/// until it has `wanted` leaves that hold corners; the strongest corner of each leaf is taken.
/// (Quad tree as in Mur-Artal & Tardos, T-RO 2017; ours works on ranges of corners sorted along the
/// Z-order curve, so that no corner is moved while splitting.)
class CornerDistribution {
 public:
  /// Replaces `chosen` by min(wanted, all) corners. The same input gives the same output.
  void choose(const std::vector<Corner>& corners, int wanted, std::vector<Corner>& chosen);

 private:
  /// A corner's place on the Z-order curve (high bits) and its index (low bits).
  using Key = std::uint64_t;
  /// A square of the quad tree that holds corners.
  struct Square {
    std::uint32_t begin;
    std::uint32_t end;
    [[nodiscard]] std::uint32_t count() const { return end - begin; }
  };

  void sort_along_curve(const std::vector<Corner>& corners);
  void split(const Square& square, int shift, std::vector<Square>& children) const;

  std::vector<Key> keys_;
  std::vector<Key> scratch_;
  std::vector<Square> squares_;
  std::vector<Square> next_;
};

}  // namespace camvox::features
