#include "camvox/results/results_component.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include "camvox/conversion/pose.hpp"
#include "camvox/trajectory/trajectory_file.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::FramePose;
using camvox_interfaces::msg::Keyframe;
using camvox_interfaces::msg::MapUpdate;
using camvox_interfaces::msg::Progress;

constexpr int kFiles = 5;
constexpr auto kTrajectory = "trajectory.tum";
constexpr std::array kStates = {"waiting", "ok", "lost", "relocalising", "localisation_only"};

/// Every message counts here, however late this component is.
constexpr SubscribeOptions kAll{.qos = {1024, true, false}, .required = false};

double percentile(const std::vector<double>& sorted, double share) {
  const auto index = share * static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<std::size_t>(index + 0.5)];
}

std::string timing_csv(const std::map<std::string, std::vector<double>>& times_s) {
  std::string text = "component,frames,median_ms,mean_ms,p95_ms,p99_ms,max_ms\n";
  for (const auto& [name, times] : times_s) {
    auto sorted = times;
    std::sort(sorted.begin(), sorted.end());
    double sum_s = 0.0;
    for (const double time_s : sorted) sum_s += time_s;
    text += fmt::format("{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f}\n",
                        name,
                        sorted.size(),
                        1e3 * percentile(sorted, 0.5),
                        1e3 * sum_s / static_cast<double>(sorted.size()),
                        1e3 * percentile(sorted, 0.95),
                        1e3 * percentile(sorted, 0.99),
                        1e3 * sorted.back());
  }
  return text;
}

}  // namespace

ResultsComponent::ResultsComponent(Context& context)
    : context_(context),
      config_(context.parameters<ResultsConfig>()),
      T_camera_body_(sensors::make_rig_calibration(config_.rig).T_body_camera.inverse()) {
  frames_csv_ =
      "frame_id,stamp_ns,state,keyframe_id,map_epoch,features,with_depth,matches,inliers,"
      "time_ms\n";
  context.subscribe<FramePose>({"frame_pose", topics::kFramePose},
                               [this](const auto& pose) { add_pose(*pose); },
                               {.qos = kAll.qos, .required = true});
  const auto add_keyframe = [this](const auto& keyframe) {
    path_.add_keyframe(keyframe->id(),
                       keyframe->header().stamp_ns(),
                       conversion::to_se3(keyframe->T_map_camera()));
  };
  const SubscribeOptions keyframes{.qos = qos::kKeyframes, .required = false};
  context.subscribe<Keyframe>({"keyframe", topics::kKeyframe}, add_keyframe, keyframes);
  context.subscribe<Keyframe>({"map_keyframe", topics::kMapKeyframe}, add_keyframe, keyframes);
  context.subscribe<Keyframe>(
      {"resent_keyframe", topics::kResentKeyframe}, add_keyframe, keyframes);
  context.subscribe<MapUpdate>({"map_update", topics::kMapUpdate},
                               [this](const auto& update) { add_update(*update); },
                               {.qos = qos::kKeyframes, .required = false});
  context.subscribe<Progress>(
      {"progress", topics::kProgress},
      [this](const auto& progress) {
        const auto& name = progress->component_name();
        came_.insert(progress->header().frame_id());
        times_s_[{name.data(), strnlen(name.data(), name.size())}].push_back(
            progress->processing_time_s());
      },
      kAll);
}

void ResultsComponent::add_pose(const FramePose& pose) {
  ++frames_;
  came_.insert(pose.header().frame_id());
  if (pose.features_with_depth() > 0) ++frames_with_depth_;
  const auto state = std::min<std::size_t>(pose.state(), kStates.size() - 1);
  frames_csv_ += fmt::format("{},{},{},{},{},{},{},{},{},{:.3f}\n",
                             pose.header().frame_id(),
                             pose.header().stamp_ns(),
                             kStates[state],
                             pose.reference_keyframe_id(),
                             pose.map_epoch(),
                             pose.features(),
                             pose.features_with_depth(),
                             pose.matches(),
                             pose.inliers(),
                             1e3F * pose.processing_time_s());
  const bool tracked = pose.state() == camvox_interfaces::msg::TRACKING_OK ||
                       pose.state() == camvox_interfaces::msg::TRACKING_LOCALISATION_ONLY;
  if (!tracked) return;
  const auto stamp_ns = pose.header().stamp_ns();
  const auto T_map_camera = conversion::to_se3(pose.T_map_camera());
  path_.add_frame({stamp_ns,
                   pose.reference_keyframe_id(),
                   conversion::to_se3(pose.T_keyframe_camera()),
                   T_map_camera});
  odometry_.push_back({stamp_ns, T_map_camera});
}

void ResultsComponent::add_update(const MapUpdate& update) {
  for (std::uint32_t i = 0; i < update.keyframe_ids_count(); ++i) {
    path_.move_keyframe(update.keyframe_ids()[i], conversion::to_se3(update.keyframe_poses()[i]));
  }
  for (std::uint32_t i = 0; i < update.removed_keyframe_ids_count(); ++i) {
    path_.remove_keyframe(update.removed_keyframe_ids()[i]);
  }
}

void ResultsComponent::stop() {
  if (!config_.output_dir.empty()) save();
  if (config_.fail_without_poses && odometry_.empty())
    throw std::runtime_error("no frame was tracked: " + why_no_pose());
}

std::string ResultsComponent::why_no_pose() const {
  if (frames_ == 0) return "not one came; see what is said of missing inputs, and the bag's topics";
  if (frames_with_depth_ == 0) {
    return fmt::format(
        "of {} frames none had depth; see what is said of missing inputs, and check the rig",
        frames_);
  }
  return fmt::format(
      "of {} frames {} had depth, but no place in the map", frames_, frames_with_depth_);
}

/// In real time tracking takes the newest frame; those that it overtakes get no pose, not even a
/// lost one.
std::string ResultsComponent::not_tried() {
  came_.erase(0);  // an image that made no frame: of these sync tells
  const auto frames = static_cast<std::size_t>(frames_);
  if (came_.size() <= frames) return {};
  return fmt::format(", {} more were passed over", came_.size() - frames);
}

void ResultsComponent::save() {
  if (frames_ == 0 &&
      std::filesystem::exists(std::filesystem::path(config_.output_dir) / kTrajectory)) {
    context_.log().warn("no frame came: the earlier results in {} stay", config_.output_dir);
    return;
  }
  const int saved =
      save_trajectory(kTrajectory, path_.frames()) + save_trajectory("odometry.tum", odometry_) +
      save_trajectory("keyframes.tum", path_.keyframes()) + save_text("frames.csv", frames_csv_) +
      save_text("timing.csv", timing_csv(times_s_));
  context_.log().info("{} of {} frames tracked{}; results in {}",
                      odometry_.size(),
                      frames_,
                      not_tried(),
                      config_.output_dir);
  if (saved < kFiles) {
    throw std::runtime_error(
        fmt::format("{} of {} result files were not saved", kFiles - saved, kFiles));
  }
}

bool ResultsComponent::save_trajectory(const char* name, trajectory::Trajectory of_camera) {
  for (auto& pose : of_camera) pose.T_world_body = pose.T_world_body * T_camera_body_;
  const auto status =
      trajectory::write_tum(std::filesystem::path(config_.output_dir) / name, of_camera);
  if (!status.ok()) context_.log().error("{}", status.message());
  return status.ok();
}

bool ResultsComponent::save_text(const char* name, const std::string& text) {
  const auto file = std::filesystem::path(config_.output_dir) / name;
  std::ofstream stream(file, std::ios::trunc);
  const bool saved = static_cast<bool>(stream << text << std::flush);
  if (!saved) {
    context_.log().error(
        "{}: cannot be written: {}", file.string(), std::generic_category().message(errno));
  }
  return saved;
}

}  // namespace camvox
