#pragma once

#include <string>

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"
#include "camvox/sync/image_decoder.hpp"

namespace camvox::sync_component {

/// Writes images of the camera's driver into frame images, each pixel once.
class ImageInput {
 public:
  /// `encoding`: mono8, yuv420 or bgr8.
  ImageInput(const sensors::CameraIntrinsics& camera, const std::string& encoding);

  /// Fills all but the header. Returns what is wrong with the image, or "".
  [[nodiscard]] std::string read(const sensor_msgs::msg::Image& image,
                                 camvox_interfaces::msg::FrameImage& frame);
  [[nodiscard]] std::string read(const sensor_msgs::msg::CompressedImage& image,
                                 camvox_interfaces::msg::FrameImage& frame);

 private:
  [[nodiscard]] sync::ImageTarget prepare(camvox_interfaces::msg::FrameImage& frame) const;

  sync::ImageDecoder decoder_;
  int width_px_;
  int height_px_;
  sync::PixelFormat format_;
};

/// How the camera that a driver describes differs from the configured one, or "".
[[nodiscard]] std::string camera_mismatch(const sensor_msgs::msg::CameraInfo& info,
                                          const sensors::CameraIntrinsics& camera);

}  // namespace camvox::sync_component
