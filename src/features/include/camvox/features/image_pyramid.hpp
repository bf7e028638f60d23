#pragma once

#include <cstdint>
#include <vector>

#include "camvox/features/image_view.hpp"

namespace camvox::features {

/// The same image at falling sizes. Level l is level l-1 made smaller by exactly `scale_factor`
/// with bilinear interpolation, pixel centres aligned at the image's corner: the pixel u of level
/// l lies at (u + 0.5) scale_factor^l - 0.5 of the full image. Keeps its memory from image to
/// image.
class ImagePyramid {
 public:
  /// `scale_factor` in (1, 1.8].
  ImagePyramid(int levels, double scale_factor);

  /// Level 0 is `image` itself, not a copy: it must outlive the use of the pyramid.
  void build(const ImageView& image);

  [[nodiscard]] int levels() const { return static_cast<int>(views_.size()); }
  [[nodiscard]] const ImageView& level(int index) const {
    return views_[static_cast<std::size_t>(index)];
  }
  /// Size of a level's pixel in pixels of the full image.
  [[nodiscard]] double scale(int index) const { return scales_[static_cast<std::size_t>(index)]; }

 private:
  /// Where eight neighbouring pixels of a row come from: byte pairs of the 16 bytes at `source`.
  struct Taps {
    std::int32_t source;
    std::uint8_t bytes[16];
    std::uint16_t weights[8];  ///< Of the second byte of each pair, of 128.
  };

  void shrink(const ImageView& from, std::size_t level);
  static void make_taps(int from_width, int width, double scale_factor, std::vector<Taps>& taps);
  static void shrink_row(const std::uint8_t* from, const std::vector<Taps>& taps, std::uint8_t* to);

  double scale_factor_;
  std::vector<ImageView> views_;
  std::vector<double> scales_;
  std::vector<std::vector<std::uint8_t>> memory_;
  std::vector<std::vector<Taps>> taps_;
  std::vector<std::uint8_t> blended_row_;
};

}  // namespace camvox::features
