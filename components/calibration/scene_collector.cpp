#include "camvox/calibration_component/scene_collector.hpp"

#include <utility>

#include "camvox/conversion/cv_image.hpp"

namespace camvox::calibration_component {
namespace {

constexpr std::size_t kMaxPoints = 2'000'000;

}  // namespace

void SceneCollector::add(const camvox_interfaces::msg::FrameImage& image,
                         const camvox_interfaces::msg::Cloud& cloud) {
  if (first_ns_ && cloud.header().stamp_ns() < *first_ns_) clear();  // the clock was set back
  last_ns_ = cloud.header().stamp_ns();
  if (!first_ns_) first_ns_ = last_ns_;
  if (scene_.image.empty() && conversion::is_well_formed(image))
    scene_.image = conversion::to_bgr(image);
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
