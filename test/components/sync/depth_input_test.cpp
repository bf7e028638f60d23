#include "camvox/sync_component/depth_input.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <memory>

namespace camvox::sync_component {
namespace {

sensors::CameraIntrinsics small_camera() {
  sensors::CameraIntrinsics camera;
  camera.width_px = 3;
  camera.height_px = 2;
  return camera;
}

template <typename T>
sensor_msgs::msg::Image depth_image(const std::string& encoding, const std::vector<T>& pixels) {
  sensor_msgs::msg::Image image;
  image.encoding(encoding);
  image.width(3);
  image.height(2);
  image.step(3 * sizeof(T));
  image.data().resize(pixels.size() * sizeof(T));
  std::memcpy(image.data().data(), pixels.data(), image.data().size());
  return image;
}

class ReadDepth : public ::testing::Test {
 protected:
  std::string read(const sensor_msgs::msg::Image& image) {
    return read_depth(image, small_camera(), {}, *depth_);
  }
  std::unique_ptr<camvox_interfaces::msg::DepthImage> depth_ =
      std::make_unique<camvox_interfaces::msg::DepthImage>();
};

TEST_F(ReadDepth, MillimetresBecomeMetresWithTheSigmaOfTheSensor) {
  ASSERT_EQ(read(depth_image<std::uint16_t>("16UC1", {0, 1000, 2400, 65535, 100, 5000})), "");
  EXPECT_EQ(depth_->depth_m_count(), 6U);
  EXPECT_EQ(depth_->sigma_m_count(), 6U);
  EXPECT_EQ(depth_->depth_m()[0], 0.0F);
  EXPECT_FLOAT_EQ(depth_->depth_m()[1], 1.0F);
  EXPECT_FLOAT_EQ(depth_->sigma_m()[2], 0.0012F + 0.0019F * 4.0F);  // Nguyen et al., at 2.4 m
  EXPECT_EQ(depth_->depth_m()[3], 0.0F);                            // "no depth" of 7-Scenes
  EXPECT_EQ(depth_->depth_m()[4], 0.0F);                            // nearer than the sensor sees
  EXPECT_FLOAT_EQ(depth_->depth_m()[5], 5.0F);
}

TEST_F(ReadDepth, TakesMetresAndDropsWhatIsNoNumber) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  ASSERT_EQ(read(depth_image<float>("32FC1", {nan, 1.5F, inf, -1.0F, 0.0F, 3.0F})), "");
  const std::vector<float> expected = {0.0F, 1.5F, 0.0F, 0.0F, 0.0F, 3.0F};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(depth_->depth_m()[i], expected[i]);
}

TEST_F(ReadDepth, RefusesOtherImages) {
  EXPECT_NE(read(depth_image<std::uint8_t>("mono8", {1, 2, 3, 4, 5, 6})), "");
  auto short_image = depth_image<std::uint16_t>("16UC1", {1, 2, 3, 4, 5, 6});
  short_image.data().pop_back();
  EXPECT_NE(read(short_image), "");
  auto wide = depth_image<std::uint16_t>("16UC1", {1, 2, 3, 4, 5, 6, 7, 8});
  wide.width(4);
  EXPECT_NE(read(wide), "");
}

}  // namespace
}  // namespace camvox::sync_component
