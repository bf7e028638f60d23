#include "camvox/dense_map/dense_map_component.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <stdexcept>

#include "camvox/conversion/image.hpp"
#include "camvox/conversion/point_cloud.hpp"
#include "camvox/conversion/pose.hpp"
#include "camvox/interfaces/header.hpp"
#include "cloud_file.hpp"

namespace camvox {
namespace {

using sensor_msgs::msg::PointCloud2;

/// Frames whose images wait for the news that they are a keyframe: as long as tracking may take.
constexpr std::size_t kFramesKept = 8;
constexpr std::size_t kMaxOpen = 64;

}  // namespace

DenseMapComponent::DenseMapComponent(Context& context)
    : context_(context),
      config_(context.parameters<DenseMapComponentConfig>()),
      map_(config_.map, sensors::CameraModel(config_.camera)),
      progress_(context),
      cloud_(context.advertise<PointCloud2>({"dense_map", topics::kDenseMap}, {.max_loans = 1})) {
  const SubscribeOptions frames{.qos = qos::kFrames, .max_held = kFramesKept};
  context.subscribe<FrameImage>(
      {"frame_image", topics::kFrameImage},
      [this](const auto& image) { keep(images_, image); },
      frames);
  context.subscribe<DepthImage>(
      {"depth_image", topics::kDepthImage},
      [this](const auto& depth) { keep(depths_, depth); },
      frames);
  context.subscribe<Keyframe>({"keyframe", topics::kKeyframe},
                              [this](const auto& keyframe) { on_keyframe(*keyframe); },
                              {.qos = qos::kKeyframes});
  // Of a loaded map: no images of it come, but frames refer to it.
  context.subscribe<Keyframe>({"map_keyframe", topics::kMapKeyframe},
                              [this](const auto& keyframe) {
                                newest_keyframe_ = std::max(newest_keyframe_, keyframe->id());
                                report_done();
                              },
                              {.qos = qos::kKeyframes, .required = false});
  context.subscribe<FramePose>({"frame_pose", topics::kFramePose},
                               [this](const auto& pose) { on_pose(*pose); },
                               {.qos = qos::kKeyframes, .required = false});
  context.subscribe<MapUpdate>({"map_update", topics::kMapUpdate},
                               [this](const auto& update) { on_update(*update); },
                               {.qos = qos::kKeyframes, .required = false});
  const auto period = std::chrono::duration<double>(config_.publish_period_s);
  context.every(std::chrono::duration_cast<std::chrono::nanoseconds>(period),
                [this] { publish(); });
}

template <typename Message>
void DenseMapComponent::keep(std::map<std::uint64_t, Sample<Message>>& frames,
                             const Sample<Message>& sample) {
  const auto work = progress_.measure();
  const auto frame_id = sample->header().frame_id();
  frames.insert_or_assign(frame_id, sample);
  while (frames.size() >= kFramesKept) frames.erase(frames.begin());
  add_if_complete(frame_id);
}

void DenseMapComponent::on_keyframe(const Keyframe& keyframe) {
  const auto work = progress_.measure();
  const auto frame_id = keyframe.header().frame_id();
  newest_keyframe_ = std::max(newest_keyframe_, keyframe.id());
  pending_[frame_id] = {keyframe.id(), conversion::to_se3(keyframe.T_map_camera())};
  add_if_complete(frame_id);
  while (pending_.size() > kFramesKept) {
    pending_.erase(pending_.begin());
    context_.diagnostics().set("keyframes without images", ++missed_);
  }
  report_done();
}

void DenseMapComponent::on_pose(const FramePose& pose) {
  const auto work = progress_.measure();
  open_.push_back({pose.header(), pose.reference_keyframe_id()});
  while (open_.size() > kMaxOpen) open_.pop_front();
  report_done();
}

/// A frame is done when it is known whether it is a keyframe, and if so, when its points are in.
void DenseMapComponent::report_done() {
  while (!open_.empty() && open_.front().reference_id <= newest_keyframe_ &&
         !pending_.contains(open_.front().header.frame_id())) {
    progress_.done(open_.front().header);
    open_.pop_front();
  }
}

void DenseMapComponent::add_if_complete(std::uint64_t frame_id) {
  const auto keyframe = pending_.find(frame_id);
  const auto image = images_.find(frame_id);
  const auto depth = depths_.find(frame_id);
  if (keyframe == pending_.end() || image == images_.end() || depth == depths_.end()) return;
  const auto& i = *image->second;
  const auto& d = *depth->second;
  const bool usable = d.depth_m_count() > 0 && conversion::is_well_formed(i) &&
                      i.width_px() == d.width_px() && i.height_px() == d.height_px();
  if (usable) {
    map_.add_keyframe(keyframe->second.id,
                      keyframe->second.T_map_camera,
                      {d.depth_m().data(),
                       d.sigma_m().data(),
                       static_cast<int>(d.width_px()),
                       static_cast<int>(d.height_px())},
                      [&i](int u_px, int v_px) {
                        const auto bgr = conversion::bgr_at(i, u_px, v_px);
                        return dense::Rgb{bgr[2], bgr[1], bgr[0]};
                      });
  }
  pending_.erase(keyframe);
  context_.diagnostics().set("points", std::uint64_t{map_.size()});
  report_done();
}

void DenseMapComponent::on_update(const MapUpdate& update) {
  for (std::uint32_t i = 0; i < update.keyframe_ids_count(); ++i) {
    map_.move_keyframe(update.keyframe_ids()[i], conversion::to_se3(update.keyframe_poses()[i]));
  }
  for (std::uint32_t i = 0; i < update.removed_keyframe_ids_count(); ++i) {
    map_.remove_keyframe(update.removed_keyframe_ids()[i]);
  }
}

void DenseMapComponent::publish() {
  if (cloud_.subscriber_count() == 0 || map_.size() == 0) return;
  auto cloud = cloud_.loan();
  cloud->header(interfaces::to_header(context_.now_ns(), "map"));
  conversion::write_points(map_.points(), *cloud);
  cloud_.publish(std::move(cloud));
}

void DenseMapComponent::stop() {
  images_.clear();
  depths_.clear();
  if (config_.output_dir.empty() || map_.size() == 0) return;
  const std::filesystem::path folder = config_.output_dir;
  const auto points = map_.points();
  int not_saved = 0;
  const auto picture = dense::draw_top_view(points, map_.keyframe_positions());
  for (const auto& problem : {dense_map::save_pcd(folder / "dense_map.pcd", points),
                              dense_map::save_ply(folder / "dense_map.ply", points),
                              dense_map::save_png(folder / "dense_map.png", picture)}) {
    if (problem.empty()) continue;
    context_.log().error("{}", problem);
    ++not_saved;
  }
  context_.log().info("dense map: {} points", points.size());
  if (not_saved > 0) throw std::runtime_error("not all of the dense map was saved");
}

}  // namespace camvox
