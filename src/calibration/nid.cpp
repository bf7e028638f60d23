#include "camvox/calibration/nid.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace camvox::calibration {
namespace {

constexpr std::size_t kBins = 16;
constexpr std::size_t kEnough = 60000;

template <typename Histogram>
double entropy(const Histogram& histogram, double total) {
  double sum = 0.0;
  for (const double n : histogram) {
    if (n > 0.0) sum -= n / total * std::log(n / total);
  }
  return sum;
}

}  // namespace

double normalised_information_distance(const Scene& scene,
                                       const sensors::CameraModel& camera,
                                       const geometry::SE3& T_camera_lidar) {
  const cv::Mat grey = to_grey(scene.image);
  std::array<double, kBins * kBins> joint{};
  std::array<double, kBins> of_grey{};
  std::array<double, kBins> of_return{};
  double total = 0.0;
  const std::size_t stride = 1 + scene.points_lidar.size() / kEnough;
  for (std::size_t i = 0; i < scene.points_lidar.size(); i += stride) {
    const Eigen::Vector4f& point = scene.points_lidar[i];
    if (!point.allFinite()) continue;
    const auto u_px = camera.project(T_camera_lidar * point.head<3>().cast<double>());
    if (!u_px || !camera.contains(*u_px)) continue;
    const auto g =
        static_cast<std::size_t>(grey.at<std::uint8_t>(static_cast<int>(std::lround(u_px->y())),
                                                       static_cast<int>(std::lround(u_px->x()))) /
                                 16);
    // Unit intervals (0 to 1) and bytes (0 to 255) both occur; the logarithm reads either.
    const float scaled = 2.0F * std::log2(1.0F + 255.0F * std::clamp(point.w(), 0.0F, 255.0F));
    const auto r = std::min(kBins - 1, static_cast<std::size_t>(scaled * 0.5F));
    joint[r * kBins + g] += 1.0;
    of_grey[g] += 1.0;
    of_return[r] += 1.0;
    total += 1.0;
  }
  if (total < 100.0) return 1.0;
  const double both = entropy(joint, total);
  if (!(both > 0.0)) return 1.0;
  const double shared = entropy(of_grey, total) + entropy(of_return, total) - both;
  return (both - shared) / both;
}

}  // namespace camvox::calibration
