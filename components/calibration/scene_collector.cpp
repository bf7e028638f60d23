#include "camvox/calibration_component/scene_collector.hpp"

#include <utility>

#include "camvox/conversion/image.hpp"

namespace camvox::calibration_component {
namespace {

constexpr std::size_t kMaxPoints = 2'000'000;

cv::Mat copy_of(const camvox_interfaces::msg::FrameImage& image) {
  cv::Mat copy(static_cast<int>(image.height_px()), static_cast<int>(image.width_px()), CV_8UC3);
  for (int row = 0; row < copy.rows; ++row) {
    for (int column = 0; column < copy.cols; ++column) {
      const auto bgr = conversion::bgr_at(image, column, row);
      copy.at<cv::Vec3b>(row, column) = {bgr[0], bgr[1], bgr[2]};
    }
  }
  return copy;
}

}  // namespace

void SceneCollector::add(const camvox_interfaces::msg::FrameImage& image,
                         const camvox_interfaces::msg::Cloud& cloud) {
  last_ns_ = cloud.header().stamp_ns();
  if (!first_ns_) first_ns_ = last_ns_;
  if (scene_.image.empty() && conversion::is_well_formed(image)) scene_.image = copy_of(image);
  for (std::uint32_t i = 0; i < cloud.points_count(); ++i) {
    if (scene_.points_lidar.size() >= kMaxPoints) break;
    scene_.points_lidar.emplace_back(cloud.points()[i].data());
  }
}

bool SceneCollector::is_complete(double collect_s) const {
  if (!first_ns_ || scene_.image.empty()) return false;
  return 1e-9 * static_cast<double>(last_ns_ - *first_ns_) >= collect_s;
}

calibration::Scene SceneCollector::take() {
  first_ns_.reset();
  return std::exchange(scene_, {});
}

}  // namespace camvox::calibration_component
