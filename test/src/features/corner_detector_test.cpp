#include "camvox/features/corner_detector.hpp"

#include <gmock/gmock.h>

#include "test_images.hpp"

namespace camvox::features {
namespace {

/// FAST as its definition says: the largest t such that some arc of 9 differs by t or more.
int slow_score(const TestImage& image, int u, int v) {
  const int circle[16][2] = {{0, -3},
                             {1, -3},
                             {2, -2},
                             {3, -1},
                             {3, 0},
                             {3, 1},
                             {2, 2},
                             {1, 3},
                             {0, 3},
                             {-1, 3},
                             {-2, 2},
                             {-3, 1},
                             {-3, 0},
                             {-3, -1},
                             {-2, -2},
                             {-1, -3}};
  int best = 0;
  for (const int sign : {1, -1}) {
    for (int start = 0; start < 16; ++start) {
      int least = 255;
      for (int k = 0; k < 9; ++k) {
        const int* offset = circle[(start + k) % 16];
        least = std::min(least, sign * (image.at(u + offset[0], v + offset[1]) - image.at(u, v)));
      }
      best = std::max(best, least);
    }
  }
  return best;
}

class SlowDetector {
 public:
  explicit SlowDetector(const TestImage& image) : image_(image) {
    for (int v = 0; v < image.height_px; ++v) {
      for (int u = 0; u < image.width_px; ++u) {
        scores_.push_back(inside(u, v) ? slow_score(image, u, v) : 0);
      }
    }
  }

  [[nodiscard]] std::vector<Corner> detect(int threshold, int low_threshold) const {
    std::vector<Corner> corners;
    const int border = CornerDetector::kBorder_px;
    append(border, border, image_.width_px, image_.height_px, threshold, corners);
    const auto strong = corners;
    for (int v = border; v < image_.height_px - border; v += CornerDetector::kCell_px) {
      for (int u = border; u < image_.width_px - border; u += CornerDetector::kCell_px) {
        const bool filled = std::any_of(strong.begin(), strong.end(), [&](const Corner& corner) {
          return corner.u_px >= u && corner.u_px < u + CornerDetector::kCell_px &&
                 corner.v_px >= v && corner.v_px < v + CornerDetector::kCell_px;
        });
        if (filled) continue;
        append(u,
               v,
               u + CornerDetector::kCell_px,
               v + CornerDetector::kCell_px,
               low_threshold,
               corners);
      }
    }
    return corners;
  }

 private:
  [[nodiscard]] bool inside(int u, int v) const {
    const int border = CornerDetector::kBorder_px;
    return u >= border && v >= border && u < image_.width_px - border &&
           v < image_.height_px - border;
  }
  [[nodiscard]] int score(int u, int v) const {
    return scores_[static_cast<std::size_t>(v * image_.width_px + u)];
  }
  [[nodiscard]] bool is_maximum(int u, int v) const {
    for (int dv = -1; dv <= 1; ++dv) {
      for (int du = -1; du <= 1; ++du) {
        const bool later = dv > 0 || (dv == 0 && du > 0);
        if (score(u + du, v + dv) > score(u, v)) return false;
        if (later && score(u + du, v + dv) == score(u, v)) return false;
      }
    }
    return true;
  }
  void append(int u0, int v0, int u1, int v1, int threshold, std::vector<Corner>& corners) const {
    for (int v = v0; v < v1; ++v) {
      for (int u = u0; u < u1; ++u) {
        if (!inside(u, v) || score(u, v) <= threshold || !is_maximum(u, v)) continue;
        corners.push_back({static_cast<std::uint16_t>(u),
                           static_cast<std::uint16_t>(v),
                           static_cast<std::uint8_t>(score(u, v))});
      }
    }
  }

  const TestImage& image_;
  std::vector<int> scores_;
};

TEST(CornerDetector, FindsWhatTheDefinitionSays) {
  for (const TestImage& image : test_images()) {
    const SlowDetector slow(image);
    for (const auto& [threshold, low] : {std::pair{20, 7}, {60, 20}, {1, 1}, {120, 7}}) {
      std::vector<Corner> corners;
      CornerDetector(threshold, low).detect(image.view(), corners);
      EXPECT_EQ(corners, slow.detect(threshold, low))
          << image.width_px << "x" << image.height_px << " threshold " << threshold;
    }
  }
}

TEST(CornerDetector, FlatAndTinyImagesHaveNone) {
  std::vector<Corner> corners = {{1, 1, 1}};
  CornerDetector detector(20, 7);
  for (const TestImage& image :
       {flat_image(200, 100), flat_image(200, 100, 255), noise_image(38, 38, 1)}) {
    detector.detect(image.view(), corners);
    EXPECT_TRUE(corners.empty());
  }
  detector.detect({}, corners);
  EXPECT_TRUE(corners.empty());
}

TEST(CornerDetector, OneObjectServesImagesOfAnySize) {
  CornerDetector used(20, 7);
  for (const TestImage& image : test_images()) {
    std::vector<Corner> corners, expected;
    used.detect(image.view(), corners);
    CornerDetector(20, 7).detect(image.view(), expected);
    EXPECT_EQ(corners, expected);
  }
}

TEST(CornerDetector, LooksCloserAtPoorCells) {
  // A faint square in a dark image, next to nothing: only the low threshold sees its corners.
  const TestImage image(
      200, 120, [](int u, int v) { return u >= 60 && u < 75 && v >= 50 && v < 65 ? 32 : 20; });
  std::vector<Corner> corners;
  CornerDetector(20, 20).detect(image.view(), corners);
  EXPECT_TRUE(corners.empty());
  CornerDetector(20, 7).detect(image.view(), corners);
  EXPECT_EQ(corners.size(), 4U);
  for (const Corner& corner : corners) EXPECT_EQ(corner.score, 12);
}

TEST(RefineCorner, IsTheVertexOfTheScores) {
  const TestImage image = block_image(200, 150, 12);
  std::vector<Corner> corners;
  CornerDetector(20, 7).detect(image.view(), corners);
  ASSERT_GT(corners.size(), 50U);
  for (const Corner& corner : corners) {
    const auto score = [&](int du, int dv) {
      return slow_score(image, corner.u_px + du, corner.v_px + dv);
    };
    const Shift shift = refine_corner(image.view(), corner);
    const double curvature_u = 2.0 * score(0, 0) - score(-1, 0) - score(1, 0);
    const double curvature_v = 2.0 * score(0, 0) - score(0, -1) - score(0, 1);
    const auto vertex = [](double slope, double curvature) {
      return curvature > 0 ? std::clamp(slope / (2.0 * curvature), -0.5, 0.5) : 0.0;
    };
    const double du_px = vertex(score(1, 0) - score(-1, 0), curvature_u);
    const double dv_px = vertex(score(0, 1) - score(0, -1), curvature_v);
    EXPECT_NEAR(shift.du_px, du_px, 1e-6);
    EXPECT_NEAR(shift.dv_px, dv_px, 1e-6);
    EXPECT_LE(std::abs(shift.du_px), 0.5F);
  }
}

TEST(RefineCorner, FollowsAnImageThatMovesByPartsOfAPixel) {
  // A bright blob of sigma 1.5 px: its centre is found to a tenth of a pixel wherever it lies.
  for (int tenths = -4; tenths <= 4; ++tenths) {
    const double centre_px = 30.0 + 0.1 * tenths;
    const TestImage image(60, 60, [&](int u, int v) {
      const double r2 = (u - centre_px) * (u - centre_px) + (v - 30.0) * (v - 30.0);
      return static_cast<int>(std::lround(20.0 + 200.0 * std::exp(-r2 / 4.5)));
    });
    const Shift shift = refine_corner(image.view(), {30, 30, 1});
    EXPECT_NEAR(shift.du_px, 0.1 * tenths, 0.12);
    EXPECT_NEAR(shift.dv_px, 0.0, 0.02);
  }
}

}  // namespace
}  // namespace camvox::features
