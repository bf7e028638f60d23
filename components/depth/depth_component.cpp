#include "camvox/depth_component/depth_component.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "camvox/conversion/pose.hpp"
#include "edge_images.hpp"

namespace camvox {
namespace {

constexpr Port kMetres{"depth", "/camvox/depth/image_raw"};
constexpr Port kMillimetres{"depth_mm", "/camvox/depth/image_mm"};
constexpr Port kCameraInfo{"camera_info", "/camvox/depth/camera_info"};

constexpr std::size_t kMaxWaiting = 4;  // clouds in lockstep; sync sends no more ahead

/// Standard deviations per axis (rad, m) of a covariance: root of the mean variance.
std::array<double, 2> sigmas_of(const geometry::Matrix6d& covariance) {
  return {std::sqrt(covariance.topLeftCorner<3, 3>().trace() / 3.0),
          std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3.0)};
}

}  // namespace

DepthComponent::DepthComponent(Context& context)
    : context_(context),
      config_(context.parameters<DepthComponentConfig>()),
      projector_(sensors::CameraModel(config_.camera), config_.projector),
      extrinsics_(sensors::make_rig_calibration(config_.rig)),
      accumulator_(config_.accumulate_scans, config_.rig),
      progress_(context),
      depth_images_(context.advertise<DepthImage>({"depth_image", topics::kDepthImage},
                                                  {.qos = qos::kFrames})),
      metres_(context.advertise<Image>(kMetres, {.qos = qos::kSensorWriter})),
      millimetres_(context.advertise<Image>(kMillimetres, {.qos = qos::kSensorWriter})),
      camera_info_(context.advertise<CameraInfo>(kCameraInfo, {.qos = qos::kSensorWriter})),
      coloured_cloud_(context, config_.camera) {
  const auto pixels = std::int64_t{config_.camera.width_px} * config_.camera.height_px;
  if (pixels > camvox_interfaces::msg::DEPTH_PIXELS) {
    throw config::ConfigError({{{}, "camera", "more pixels than a depth image can hold"}});
  }
  context.subscribe<Extrinsics>({"extrinsics", topics::kExtrinsics},
                                [this](const auto& extrinsics) { on_extrinsics(*extrinsics); },
                                {.qos = qos::kState, .required = false});
  context.subscribe<Cloud>({"cloud", topics::kCloud},
                           [this](const auto& cloud) { on_cloud(cloud); },
                           {.qos = qos::kFrames, .max_held = static_cast<int>(kMaxWaiting) + 1});
  if (config_.accumulate_scans == 1) return;
  context.subscribe<FramePose>({"frame_pose", topics::kFramePose},
                               [this](const auto& pose) { on_pose(*pose); },
                               {.qos = qos::kKeyframes});
}

void DepthComponent::on_extrinsics(const Extrinsics& extrinsics) {
  if (!extrinsics_.take(extrinsics)) return;
  const auto [rotation_rad, translation_m] =
      sigmas_of(conversion::to_matrix(extrinsics.covariance_lidar()));
  if (std::isfinite(rotation_rad) && std::isfinite(translation_m)) {
    projector_.set_extrinsics_sigma(rotation_rad, translation_m);
  }
  context_.log().info("extrinsics version {} from now on", extrinsics_.version());
}

void DepthComponent::on_cloud(const Sample<Cloud>& cloud) {
  const auto work = progress_.measure();
  if (!config_.lockstep || config_.accumulate_scans == 1) return process(*cloud);
  waiting_.push_back(cloud);
  process_waiting();
  if (waiting_.size() > kMaxWaiting) {  // tracking left a frame out: better late than never
    process(*waiting_.front());
    waiting_.pop_front();
  }
}

void DepthComponent::on_pose(const FramePose& pose) {
  const auto work = progress_.measure();
  newest_pose_id_ = std::max(newest_pose_id_, pose.header().frame_id());
  accumulator_.add_pose(pose);
  process_waiting();
}

void DepthComponent::process_waiting() {
  while (!waiting_.empty()) {
    if (newest_pose_id_ < last_cloud_id_) return;
    process(*waiting_.front());
    waiting_.pop_front();
  }
}

void DepthComponent::process(const Cloud& cloud) {
  last_cloud_id_ = cloud.header().frame_id();
  auto depth = depth_images_.loan();
  depth->header() = cloud.header();
  depth->extrinsics_version(extrinsics_.version());
  depth->width_px(static_cast<std::uint32_t>(config_.camera.width_px));
  depth->height_px(static_cast<std::uint32_t>(config_.camera.height_px));
  if (cloud.points_count() > 0) {
    const std::size_t pixels = std::size_t{depth->width_px()} * depth->height_px();
    const auto report = projector_.project(accumulator_.add(cloud, extrinsics_.T_camera_lidar()),
                                           {depth->depth_m().data(), pixels},
                                           {depth->sigma_m().data(), pixels});
    depth->depth_m_count(static_cast<std::uint32_t>(pixels));
    depth->sigma_m_count(static_cast<std::uint32_t>(pixels));
    context_.diagnostics().set("returns", report.returns);
    context_.diagnostics().set("returns in image", report.projected);
    context_.diagnostics().set("pixels with depth", report.filled_px);
  }
  publish_edge_topics(*depth);
  coloured_cloud_.add(cloud, *depth, extrinsics_.T_camera_lidar());
  depth_images_.publish(std::move(depth));
  progress_.done(cloud.header());
}

void DepthComponent::publish_edge_topics(const DepthImage& depth) {
  if (metres_.subscriber_count() > 0) {
    auto image = metres_.loan();
    depth_component::write_metres(depth, *image);
    metres_.publish(std::move(image));
  }
  if (millimetres_.subscriber_count() > 0) {
    auto image = millimetres_.loan();
    depth_component::write_millimetres(depth, *image);
    millimetres_.publish(std::move(image));
  }
  if (camera_info_.subscriber_count() > 0) {
    auto info = camera_info_.loan();
    depth_component::write_camera_info(depth, config_.camera, *info);
    camera_info_.publish(std::move(info));
  }
}

}  // namespace camvox
