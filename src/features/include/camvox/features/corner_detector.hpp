#pragma once

#include <cstdint>
#include <vector>

#include "camvox/features/image_view.hpp"

namespace camvox::features {

/// A corner at a pixel of one pyramid level.
struct Corner {
  std::uint16_t u_px = 0;
  std::uint16_t v_px = 0;
  std::uint8_t score = 0;  ///< The largest threshold at which it is no corner yet, plus one.

  bool operator==(const Corner&) const = default;
};

/// Where between pixels the score of a corner is largest, as a shift of at most half a pixel: the
/// vertex of a parabola through the scores of the neighbours, along the rows and along the columns.
/// It halves the error of a corner's place. The corner is at least 4 px away from the image's edge.
struct Shift {
  float du_px = 0.0F;
  float dv_px = 0.0F;
};
[[nodiscard]] Shift refine_corner(const ImageView& image, const Corner& corner);

/// Finds FAST-9/16 corners (Rosten & Drummond, ECCV 2006): pixels for which at least 9 connected
/// pixels of the 16 on a circle of radius 3 are all brighter, or all darker, by more than a
/// threshold. The score is the largest such difference. Kept are local maxima of the score over 3x3
/// pixels (of equal neighbours the last in reading order). In cells of 30x30 px without a corner
/// above `threshold`, those above `low_threshold` are taken.
class CornerDetector {
 public:
  static constexpr int kBorder_px = 19;  ///< No corner is nearer to the image's edge.
  static constexpr int kCell_px = 30;

  CornerDetector(int threshold, int low_threshold);

  /// Replaces `corners` by those of the image: first all above `threshold` in reading order, then
  /// those of the poor cells, cell by cell.
  void detect(const ImageView& image, std::vector<Corner>& corners);

 private:
  struct Region;
  void detect_rows(const ImageView& image, const Region& region, std::vector<Corner>& corners);
  void detect_cell(const ImageView& image,
                   const Region& region,
                   int cell,
                   std::vector<Corner>& corners);

  int threshold_;
  int low_threshold_;
  std::vector<std::uint8_t> score_rows_;
  std::vector<std::int32_t> blocks_[3];
  std::vector<std::uint8_t> cell_filled_;
};

}  // namespace camvox::features
