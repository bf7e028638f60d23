#include "camvox/dense/image_view.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace camvox::dense {
namespace {

TEST(ColourAt, ReadsPackedPixelsWithGapsBetweenRows) {
  const std::vector<std::uint8_t> bytes = {1, 2, 3, 4, 5, 6, 99, 7, 8, 9, 10, 11, 12, 99};
  EXPECT_EQ(colour_at({bytes.data(), 2, 2, 7, Encoding::kRgb8}, 1, 1), (Rgb{10, 11, 12}));
  EXPECT_EQ(colour_at({bytes.data(), 2, 2, 7, Encoding::kBgr8}, 1, 1), (Rgb{12, 11, 10}));
  EXPECT_EQ(colour_at({bytes.data(), 2, 2, 7, Encoding::kMono8}, 1, 1), (Rgb{8, 8, 8}));
}

// JFIF's own corners: white, black, and pure red (Y 76, Cb 85, Cr 255).
TEST(ColourAt, ConvertsYuvOfOddSize) {
  std::vector<std::uint8_t> bytes(9 + 4 + 4, 128);
  bytes[8] = 76;  // pixel (2, 2)
  bytes[9 + 3] = 85;
  bytes[9 + 4 + 3] = 255;
  bytes[0] = 255;
  bytes[4] = 0;
  const ImageView image{bytes.data(), 3, 3, 3, Encoding::kYuv420};
  EXPECT_EQ(colour_at(image, 0, 0), (Rgb{255, 255, 255}));
  EXPECT_EQ(colour_at(image, 1, 1), (Rgb{0, 0, 0}));
  const auto red = colour_at(image, 2, 2);
  EXPECT_NEAR(red[0], 254, 1);
  EXPECT_NEAR(red[1], 0, 1);
  EXPECT_NEAR(red[2], 0, 1);
}

}  // namespace
}  // namespace camvox::dense
