#include "camvox/conversion/keyframe.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <memory>

namespace camvox::conversion {
namespace {

using camvox_interfaces::msg::Keyframe;

features::FrameFeatures some_features(std::size_t count) {
  features::FrameFeatures features;
  for (std::size_t i = 0; i < count; ++i) {
    const auto value = static_cast<float>(i);
    features.key_points.push_back(
        {value, value + 1.0F, 0.5F, 9.0F, static_cast<std::uint8_t>(i % 8)});
    features.undistorted_px.emplace_back(value + 0.25F, value + 0.75F);
    features::Descriptor descriptor;
    descriptor.bytes[i % 32] = static_cast<std::uint8_t>(i);
    features.descriptors.push_back(descriptor);
    features.depth_m.push_back(value * 0.1F);
    features.depth_sigma_m.push_back(0.02F);
  }
  return features;
}

TEST(KeyframeConversionTest, ReadsWhatItWrote) {
  const auto features = some_features(1500);
  const auto message = std::make_unique<Keyframe>();
  ASSERT_TRUE(write_features(features, *message));
  const auto read = read_features(*message);
  ASSERT_EQ(read.size(), features.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read.key_points[i].u_px, features.key_points[i].u_px);
    EXPECT_EQ(read.key_points[i].v_px, features.key_points[i].v_px);
    EXPECT_EQ(read.key_points[i].angle_rad, features.key_points[i].angle_rad);
    EXPECT_EQ(read.key_points[i].response, features.key_points[i].response);
    EXPECT_EQ(read.key_points[i].octave, features.key_points[i].octave);
    EXPECT_EQ(read.undistorted_px[i], features.undistorted_px[i]);
    EXPECT_EQ(read.descriptors[i], features.descriptors[i]);
    EXPECT_EQ(read.depth_m[i], features.depth_m[i]);
    EXPECT_EQ(read.depth_sigma_m[i], features.depth_sigma_m[i]);
  }
}

TEST(KeyframeConversionTest, RefusesMoreThanFits) {
  const auto message = std::make_unique<Keyframe>();
  EXPECT_FALSE(write_features(some_features(5000), *message));
  EXPECT_EQ(message->features_count(), 0U);
}

TEST(KeyframeConversionTest, RefusesListsOfDifferentLengthAndNaN) {
  const auto message = std::make_unique<Keyframe>();
  ASSERT_TRUE(write_features(some_features(3), *message));
  message->depth_count(2);
  EXPECT_THROW((void)read_features(*message), std::invalid_argument);
  message->depth_count(3);
  message->features()[1][2] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW((void)read_features(*message), std::invalid_argument);
}

}  // namespace
}  // namespace camvox::conversion
