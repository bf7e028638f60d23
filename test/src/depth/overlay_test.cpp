#include "camvox/depth/overlay.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace camvox::depth {
namespace {

constexpr int kWidth = 700, kHeight = 40;

/// Depth on the left half: 2 m in the upper rows, 50 m in the lower ones; none on the right.
class OverlayTest : public ::testing::Test {
 protected:
  OverlayTest() {
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth / 2; ++u) {
        depth_m_[static_cast<std::size_t>(v * kWidth + u)] = v < kHeight / 2 ? 2.0F : 50.0F;
      }
    }
  }
  [[nodiscard]] DepthView view() const { return {depth_m_.data(), nullptr, kWidth, kHeight}; }

  std::vector<float> depth_m_ = std::vector<float>(kWidth * kHeight, 0.0F);
  cv::Mat image_ = cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(200));
};

TEST_F(OverlayTest, SummaryCountsPixelsWithDepth) {
  const auto summary = summarise(view());
  EXPECT_DOUBLE_EQ(summary.filled_share, 0.5);
  EXPECT_EQ(summary.nearest_m, 2.0F);
  EXPECT_EQ(summary.farthest_m, 50.0F);
  EXPECT_EQ(describe({12, 1'700'000'000'050'000'000}, summary),
            "frame 12    stamp 1700000000.050000000 s    depth in 50.0 % of the pixels, 2.00 to "
            "50.0 m");
}

TEST_F(OverlayTest, NearIsRedFarIsBlueAndTheRestStaysGrey) {
  const cv::Mat picture = draw_overlay(image_, view(), {});
  ASSERT_EQ(picture.type(), CV_8UC3);
  ASSERT_EQ(picture.cols, kWidth);
  ASSERT_GT(picture.rows, kHeight) << "scale and text stand below the image, not on it";
  const auto near = picture.at<cv::Vec3b>(5, 100), far = picture.at<cv::Vec3b>(35, 100);
  EXPECT_GT(near[2], 2 * near[0]);
  EXPECT_GT(far[0], 2 * far[2]);
  const auto none = picture.at<cv::Vec3b>(5, 600);
  EXPECT_EQ(none[0], none[1]);
  EXPECT_EQ(none[1], none[2]);
  EXPECT_GT(none[0], 100);
}

TEST_F(OverlayTest, TheImageShowsThroughTheColours) {
  image_.at<std::uint8_t>(5, 100) = 0;
  const cv::Mat picture = draw_overlay(image_, view(), {});
  EXPECT_LT(picture.at<cv::Vec3b>(5, 100)[2], picture.at<cv::Vec3b>(5, 101)[2]);
}

TEST_F(OverlayTest, SmallAndColouredImagesAndOneDepthDo) {
  const std::vector<float> depth_m = {0.0F, 7.0F, 0.0F, 0.0F};
  const cv::Mat image(2, 2, CV_8UC3, cv::Scalar(10, 20, 30));
  EXPECT_GE(draw_overlay(image, {depth_m.data(), nullptr, 2, 2}, {}).cols, 640);
}

TEST_F(OverlayTest, NoDepthIsSaid) {
  depth_m_.assign(depth_m_.size(), 0.0F);
  EXPECT_EQ(draw_overlay(image_, view(), {}).cols, kWidth);
  EXPECT_NE(describe({}, summarise(view())).find("no depth"), std::string::npos);
}

TEST_F(OverlayTest, OtherSizesAreRefused) {
  EXPECT_THROW((void)draw_overlay(image_.rowRange(0, 5), view(), {}), std::logic_error);
  EXPECT_THROW((void)draw_overlay(cv::Mat(), {depth_m_.data(), nullptr, 0, 0}, {}),
               std::logic_error);
}

}  // namespace
}  // namespace camvox::depth
