#include "camvox/calibration_component/scene_collector.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace camvox::calibration_component {
namespace {

using camvox_interfaces::msg::Cloud;
using camvox_interfaces::msg::FrameImage;

/// Two pixels, one above the other.
std::unique_ptr<FrameImage> image(std::uint8_t value) {
  auto message = std::make_unique<FrameImage>();
  message->width_px(1);
  message->height_px(2);
  message->row_step_bytes(3);
  message->encoding(camvox_interfaces::msg::ENCODING_BGR8);
  message->data_count(6);
  for (std::size_t i = 0; i < 6; ++i) {
    message->data()[i] = static_cast<std::uint8_t>(value + i);
  }
  return message;
}

std::unique_ptr<Cloud> cloud(double stamp_s, std::uint32_t points) {
  auto message = std::make_unique<Cloud>();
  message->header().stamp_ns(static_cast<std::int64_t>(1e9 * stamp_s));
  message->points_count(points);
  for (std::uint32_t i = 0; i < points; ++i) {
    message->points()[i] = {static_cast<float>(i), 2.0F, 3.0F, 4.0F};
  }
  return message;
}

TEST(SceneCollector, TakesTheFirstImageAndTheReturnsOfAllClouds) {
  SceneCollector collector;
  EXPECT_FALSE(collector.is_complete(0.0));
  collector.add(*image(10), *cloud(5.0, 2));
  collector.add(*image(50), *cloud(6.0, 3));
  EXPECT_FALSE(collector.is_complete(1.1));
  EXPECT_TRUE(collector.is_complete(1.0));
  const auto scene = collector.take();
  ASSERT_EQ(scene.image.size(), cv::Size(1, 2));
  EXPECT_EQ(scene.image.at<cv::Vec3b>(1, 0), cv::Vec3b(13, 14, 15));
  ASSERT_EQ(scene.points_lidar.size(), 5U);
  EXPECT_EQ(scene.points_lidar[4], Eigen::Vector4f(2.0F, 2.0F, 3.0F, 4.0F));
  EXPECT_FALSE(collector.is_complete(0.0)) << "the next scene begins empty";
}

TEST(SceneCollector, WaitsForAnImageThatCanBeUsed) {
  SceneCollector collector;
  collector.add(*std::make_unique<FrameImage>(), *cloud(5.0, 1));
  collector.add(*std::make_unique<FrameImage>(), *cloud(9.0, 1));
  EXPECT_FALSE(collector.is_complete(4.0));
  collector.add(*image(10), *cloud(9.1, 1));
  EXPECT_TRUE(collector.is_complete(4.0));
  collector.clear();
  EXPECT_FALSE(collector.is_complete(0.0));
  EXPECT_TRUE(collector.take().points_lidar.empty());
}

TEST(SceneCollector, BeginsAnewWhenTheClockIsSetBack) {
  SceneCollector collector;
  collector.add(*image(10), *cloud(100.0, 2));
  collector.add(*image(20), *cloud(101.0, 2));
  collector.add(*image(30), *cloud(5.0, 3));
  EXPECT_FALSE(collector.is_complete(1.0));
  collector.add(*image(40), *cloud(6.0, 4));
  EXPECT_TRUE(collector.is_complete(1.0));
  const auto scene = collector.take();
  EXPECT_EQ(scene.points_lidar.size(), 7U);
  EXPECT_EQ(scene.image.at<cv::Vec3b>(0, 0)[0], 30) << "nothing from before";
}

}  // namespace
}  // namespace camvox::calibration_component
