#include "camvox/dense/top_view.hpp"

#include <gtest/gtest.h>

namespace camvox::dense {
namespace {

Rgb pixel(const Picture& picture, int u, int v) {
  const auto i = 3 * static_cast<std::size_t>(v * picture.width_px + u);
  return {picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2]};
}

TEST(TopView, XIsRightAndYIsUpAndTheHighestPointWins) {
  const std::vector<ColouredPoint> points = {{{0.0F, 0.0F, 0.0F}, {1, 1, 1}},
                                             {{10.0F, 0.0F, 5.0F}, {2, 2, 2}},
                                             {{10.0F, 0.0F, 1.0F}, {3, 3, 3}},
                                             {{0.0F, 5.0F, 0.0F}, {4, 4, 4}}};
  const auto picture = draw_top_view(points, {}, 101);
  ASSERT_EQ(picture.width_px, 101);
  ASSERT_EQ(picture.height_px, 51);
  EXPECT_NEAR(picture.m_per_px, 0.1, 1e-6);
  EXPECT_EQ(pixel(picture, 0, 50), (Rgb{1, 1, 1}));
  EXPECT_EQ(pixel(picture, 100, 50), (Rgb{2, 2, 2}));
  EXPECT_EQ(pixel(picture, 0, 0), (Rgb{4, 4, 4}));
  EXPECT_EQ(pixel(picture, 50, 25), (Rgb{0, 0, 0}));
}

TEST(TopView, DrawsThePathOnTop) {
  const std::vector<ColouredPoint> points = {{{0.0F, 0.0F, 0.0F}, {1, 1, 1}},
                                             {{10.0F, 10.0F, 50.0F}, {1, 1, 1}}};
  const auto picture = draw_top_view(points, {{0.0, 5.0, 0.0}, {10.0, 5.0, 0.0}}, 101);
  for (int u = 0; u <= 100; ++u) EXPECT_EQ(pixel(picture, u, 50)[0], 255) << u;
}

TEST(TopView, NothingFromNothingAndOnePixelFromOnePoint) {
  EXPECT_EQ(draw_top_view({}, {{0.0, 0.0, 0.0}}).width_px, 0);
  EXPECT_EQ(draw_top_view({{{3.0F, 4.0F, 5.0F}, {9, 9, 9}}}, {}).rgb,
            (std::vector<std::uint8_t>{9, 9, 9}));
}

TEST(TopView, OneFarPointDoesNotShrinkTheRest) {
  std::vector<ColouredPoint> points;
  for (int i = 0; i < 1000; ++i)
    points.push_back({{0.01F * static_cast<float>(i), 0.0F, 0.0F}, {}});
  points.push_back({{1e5F, 0.0F, 0.0F}, {}});
  EXPECT_LT(draw_top_view(points, {}, 100).m_per_px, 0.2);
}

}  // namespace
}  // namespace camvox::dense
