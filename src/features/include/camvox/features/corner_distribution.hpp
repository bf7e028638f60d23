#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "camvox/features/corner_detector.hpp"

namespace camvox::features {

/// Chooses corners so that both strong ones and all parts of the image are represented. A share is
/// spread evenly: a quad tree is split, fullest squares first, until it has enough leaves that hold
/// corners, and the strongest corner of each leaf is taken (Mur-Artal & Tardos, T-RO 2017; ours
/// works on ranges of corners sorted along the Z-order curve, so that no corner is moved while
/// splitting). The rest are the strongest left: on real images they are found again in the next
/// frame far more often, while the even half already fixes the geometry.
class CornerDistribution {
 public:
  /// `even_share` in [0, 1]: which part of the corners is spread evenly.
  explicit CornerDistribution(double even_share) : even_share_(even_share) {}

  /// Replaces `chosen` by min(wanted, all) corners, in the order given.
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
  void grow_tree(std::size_t corners, std::size_t leaves);
  void take_strongest(const std::vector<Corner>& corners, std::size_t count);
  void split(const Square& square, int shift, std::vector<Square>& children) const;

  double even_share_;
  std::vector<Key> keys_;
  std::vector<Key> scratch_;
  std::vector<Square> squares_;
  std::vector<Square> next_;
  std::vector<std::uint8_t> taken_;
};

}  // namespace camvox::features
