#include <gmock/gmock.h>

#include "camvox/sync_component/image_input.hpp"

namespace camvox::sync_component {
namespace {

using ::testing::HasSubstr;

sensor_msgs::msg::CameraInfo info_of(const sensors::CameraIntrinsics& camera) {
  sensor_msgs::msg::CameraInfo info;
  info.width(static_cast<std::uint32_t>(camera.width_px));
  info.height(static_cast<std::uint32_t>(camera.height_px));
  info.k({camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1});
  info.distortion_model(camera.distortion_model);
  info.d(camera.distortion);
  return info;
}

TEST(CameraMismatch, AcceptsTheSameCamera) {
  const sensors::CameraIntrinsics camera;
  EXPECT_EQ(camera_mismatch(info_of(camera), camera), "");
}

TEST(CameraMismatch, MissingCoefficientsAreZero) {
  const sensors::CameraIntrinsics camera;
  auto info = info_of(camera);
  info.d().pop_back();
  EXPECT_EQ(camera_mismatch(info, camera), "");
}

TEST(CameraMismatch, AnUncalibratedDriverSaysNothing) {
  const sensors::CameraIntrinsics camera;
  auto info = info_of(camera);
  info.k({});
  info.d().clear();
  EXPECT_EQ(camera_mismatch(info, camera), "");
}

TEST(CameraMismatch, NamesWhatDiffers) {
  const sensors::CameraIntrinsics camera;
  auto info = info_of(camera);
  info.k()[4] += 1.0;
  EXPECT_THAT(camera_mismatch(info, camera), HasSubstr("fy"));
  info = info_of(camera);
  info.d()[1] = 0.0;
  EXPECT_THAT(camera_mismatch(info, camera), HasSubstr("distortion[1]"));
  info = info_of(camera);
  info.distortion_model("equidistant");
  EXPECT_THAT(camera_mismatch(info, camera), HasSubstr("equidistant"));
  info = info_of(camera);
  info.height(1);
  EXPECT_THAT(camera_mismatch(info, camera), HasSubstr("pixels"));
}

}  // namespace
}  // namespace camvox::sync_component
