#include "camvox/depth_component/coloured_cloud.hpp"

#include <algorithm>
#include <cmath>

#include "camvox/conversion/image.hpp"
#include "camvox/conversion/point_cloud.hpp"
#include "camvox/interfaces/header.hpp"
#include "edge_images.hpp"

namespace camvox::depth_component {
namespace {

using camvox_interfaces::msg::Cloud;
using camvox_interfaces::msg::DepthImage;

constexpr std::size_t kFramesKept = 4;
/// A return is behind a surface when it is farther by these sigmas and this share.
constexpr float kSigmas = 5.0F;
constexpr float kShare = 0.03F;

bool is_hidden(const DepthImage& depth, int u_px, int v_px, float z_m) {
  const auto pixel = static_cast<std::size_t>(v_px) * depth.width_px() + std::size_t(u_px);
  if (pixel >= depth.depth_m_count()) return false;
  const float surface_m = depth.depth_m()[pixel];
  const float margin_m = kSigmas * depth.sigma_m()[pixel] + kShare * surface_m;
  return surface_m > 0.0F && z_m > surface_m + margin_m;
}

}  // namespace

ColouredCloudOutput::ColouredCloudOutput(Context& context, const sensors::CameraIntrinsics& camera)
    : camera_(camera),
      clouds_(context.advertise<PointCloud2>({"coloured_cloud", "/camvox/coloured_cloud"},
                                             {.qos = qos::kSensorWriter})) {
  context.subscribe<FrameImage>(
      {"frame_image", topics::kFrameImage},
      [this](const auto& image) {
        if (clouds_.subscriber_count() == 0) return images_.clear();
        const auto frame_id = image->header().frame_id();
        images_.insert_or_assign(frame_id, image);
        publish_if_complete(frame_id);
        while (images_.size() > kFramesKept) images_.erase(images_.begin());
      },
      {.qos = qos::kFrames, .max_held = kFramesKept + 1, .required = false});
}

void ColouredCloudOutput::add(const Cloud& cloud,
                              const DepthImage& depth,
                              const geometry::SE3& T_camera_lidar) {
  if (clouds_.subscriber_count() == 0) return uncoloured_.clear();
  const auto frame_id = cloud.header().frame_id();
  auto& entry = uncoloured_[frame_id];
  entry = {cloud.header().stamp_ns(), {}};
  for (std::uint32_t i = 0; i < cloud.points_count(); ++i) {
    const auto& row = cloud.points()[i];
    const Eigen::Vector3d p_camera =
        T_camera_lidar * Eigen::Vector3f(row[0], row[1], row[2]).cast<double>();
    const auto at_px = p_camera.allFinite() ? camera_.project(p_camera) : std::nullopt;
    if (!at_px || !camera_.contains(*at_px, 0.0)) continue;
    const int u_px = static_cast<int>(std::lround(at_px->x()));
    const int v_px = static_cast<int>(std::lround(at_px->y()));
    if (is_hidden(depth, u_px, v_px, static_cast<float>(p_camera.z()))) continue;
    entry.returns.push_back({p_camera.cast<float>(), u_px, v_px});
  }
  publish_if_complete(frame_id);
  while (uncoloured_.size() > kFramesKept) uncoloured_.erase(uncoloured_.begin());
}

void ColouredCloudOutput::publish_if_complete(std::uint64_t frame_id) {
  const auto image = images_.find(frame_id);
  const auto cloud = uncoloured_.find(frame_id);
  if (image == images_.end() || cloud == uncoloured_.end()) return;
  const auto& intrinsics = camera_.intrinsics();
  const auto& pixels = *image->second;
  const bool usable = conversion::is_well_formed(pixels) &&
                      static_cast<int>(pixels.width_px()) == intrinsics.width_px &&
                      static_cast<int>(pixels.height_px()) == intrinsics.height_px;
  if (usable) {
    std::vector<dense::ColouredPoint> points;
    points.reserve(cloud->second.returns.size());
    for (const auto& seen : cloud->second.returns) {
      const auto bgr = conversion::bgr_at(pixels, seen.u_px, seen.v_px);
      points.push_back({seen.p_camera, {bgr[2], bgr[1], bgr[0]}});
    }
    auto message = clouds_.loan();
    message->header(interfaces::to_header(cloud->second.stamp_ns, kCameraFrame));
    conversion::write_points(points, *message);
    clouds_.publish(std::move(message));
  }
  images_.erase(image);
  uncoloured_.erase(cloud);
}

}  // namespace camvox::depth_component
