#include "camvox/conversion/image.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace camvox::conversion {
namespace {

namespace msg = camvox_interfaces::msg;
using Bgr = std::array<std::uint8_t, 3>;

class ImageTest : public ::testing::Test {
 protected:
  /// A 5x3 image.
  void set(std::uint8_t encoding, std::uint32_t row_step, std::uint32_t count) {
    image_->width_px(5);
    image_->height_px(3);
    image_->row_step_bytes(row_step);
    image_->data_count(count);
    image_->encoding(encoding);
  }
  std::unique_ptr<msg::FrameImage> image_ = std::make_unique<msg::FrameImage>();
};

TEST_F(ImageTest, GreyIsInPlace) {
  set(msg::ENCODING_MONO8, 8, 24);
  image_->data()[8 * 2 + 4] = 77;
  const auto view = grey_view(*image_);
  ASSERT_TRUE(view);
  EXPECT_EQ(view->data, image_->data().data());
  EXPECT_EQ(view->data[view->row_step_bytes * 2 + 4], 77);
  EXPECT_EQ(bgr_at(*image_, 4, 2), (Bgr{77, 77, 77}));
}

TEST_F(ImageTest, PlanesReadAsGreyAndGiveColour) {
  set(msg::ENCODING_YUV420, 6, 6 * 4 + 2 * 2 * 3);
  // Pure red by JPEG's formulas: Y 76, Cb 85, Cr 255; at the last pixel, in the last block.
  image_->data()[6 * 2 + 4] = 76;
  image_->data()[6 * 4 + 5] = 85;
  image_->data()[6 * 4 + 6 + 5] = 255;
  const auto view = grey_view(*image_);
  ASSERT_TRUE(view);
  EXPECT_EQ(view->data[6 * 2 + 4], 76);
  const auto colour = bgr_at(*image_, 4, 2);
  EXPECT_NEAR(colour[0], 0, 1);
  EXPECT_NEAR(colour[1], 0, 1);
  EXPECT_NEAR(colour[2], 254, 1);
}

TEST_F(ImageTest, InterleavedColoursHaveNoGreyView) {
  set(msg::ENCODING_BGR8, 15, 45);
  for (std::size_t i = 0; i < 3; ++i) image_->data()[15 + 3 + i] = static_cast<std::uint8_t>(i + 1);
  EXPECT_FALSE(grey_view(*image_));
  EXPECT_EQ(bgr_at(*image_, 1, 1), (Bgr{1, 2, 3}));
  image_->encoding(msg::ENCODING_RGB8);
  EXPECT_EQ(bgr_at(*image_, 1, 1), (Bgr{3, 2, 1}));
}

TEST_F(ImageTest, RefusesSizesThatDoNotAddUp) {
  for (const auto encoding : {msg::ENCODING_MONO8, msg::ENCODING_BGR8, msg::ENCODING_YUV420}) {
    set(encoding, 15, 100);
    EXPECT_TRUE(is_well_formed(*image_));
    set(encoding, 4, 100);
    EXPECT_FALSE(is_well_formed(*image_));
    set(encoding, 15, 30);
    EXPECT_FALSE(is_well_formed(*image_));
    image_->width_px(0);
    EXPECT_FALSE(is_well_formed(*image_));
  }
  set(9, 15, 100);
  EXPECT_FALSE(is_well_formed(*image_));
}

}  // namespace
}  // namespace camvox::conversion
