#include "camvox/tracking_component/tracking_component.hpp"

#include <cmath>

#include "camvox/conversion/image.hpp"
#include "camvox/conversion/map_messages.hpp"
#include "camvox/conversion/pose.hpp"

namespace camvox {
namespace {

namespace msg = camvox_interfaces::msg;

/// Rotation from this camera frame to the one before, from what the gyro says in the IMU's axes.
std::optional<geometry::SO3> camera_rotation(const std::array<double, 4>& rotation_imu,
                                             const geometry::SO3& R_camera_imu) {
  const Eigen::Quaterniond q(rotation_imu[3], rotation_imu[0], rotation_imu[1], rotation_imu[2]);
  if (std::abs(q.norm() - 1.0) > 1e-3) return std::nullopt;  // 0 0 0 0: not known
  return R_camera_imu * geometry::SO3(q) * R_camera_imu.inverse();
}

/// The tracker's switches follow from the component's, which mapping has as well.
tracking::TrackerConfig tracker_config(const TrackingComponentConfig& config) {
  auto tracker = config.tracker;
  tracker.localisation_only = tracker.localisation_only || config.localisation_only;
  tracker.relocalise_at_start = tracker.relocalise_at_start || !config.load_map.empty();
  return tracker;
}

}  // namespace

TrackingComponent::TrackingComponent(Context& context)
    : context_(context),
      config_(context.parameters<TrackingComponentConfig>()),
      rig_(sensors::make_rig_calibration(config_.rig)),
      extrinsics_(rig_),
      builder_(config_.frame, config_.camera),
      tracker_(tracker_config(config_), builder_.tracking_camera(), rig_.T_body_camera),
      queue_(config_.use_imu, config_.lockstep),
      store_(static_cast<std::size_t>(config_.keyframes_kept)),
      odometry_(context, rig_.T_body_camera),
      progress_(context),
      poses_(context.advertise<msg::FramePose>({"frame_pose", topics::kFramePose},
                                               {.qos = qos::kKeyframes})),
      keyframes_(context.advertise<msg::Keyframe>({"keyframe", topics::kKeyframe},
                                                  {.qos = qos::kKeyframes})),
      resent_keyframes_(context.advertise<msg::Keyframe>(
          {"resent_keyframe", topics::kResentKeyframe}, {.qos = qos::kKeyframes})),
      requests_(context.advertise<msg::Keyframe>(
          {"relocalisation_request", topics::kRelocalisationRequest})) {
  constexpr int kHeld = static_cast<int>(tracking_component::FrameQueue::kCapacity) + 1;
  const auto collect = [this](const auto& sample) {
    const auto work = progress_.measure();
    queue_.add(sample);
    process_ready();
  };
  context.subscribe<msg::FrameImage>(
      {"frame_image", topics::kFrameImage}, collect, {.qos = qos::kFrames, .max_held = kHeld});
  context.subscribe<msg::DepthImage>(
      {"depth_image", topics::kDepthImage}, collect, {.qos = qos::kFrames, .max_held = kHeld});
  if (config_.use_imu) {
    context.subscribe<msg::Extrinsics>(
        {"extrinsics", topics::kExtrinsics},
        [this](const auto& extrinsics) { on_extrinsics(*extrinsics); },
        {.qos = qos::kState, .required = false});
    context.subscribe<msg::Cloud>({"cloud", topics::kCloud},
                                  [this, collect](const auto& cloud) {
                                    remember_rotation(*cloud);
                                    collect(cloud);
                                  },
                                  {.qos = qos::kFrames, .max_held = kHeld});
  }
  context.subscribe<msg::LocalMap>(
      {"local_map", topics::kLocalMap},
      [this](const auto& map) { on_map(*map); },
      {.qos = qos::kFrames, .required = config_.lockstep && config_.wait_for_map});
  context.subscribe<msg::RelocalisationAnswer>(
      {"relocalisation_answer", topics::kRelocalisationAnswer},
      [this](const auto& answer) { on_answer(*answer); },
      {.required = false});
}

void TrackingComponent::on_extrinsics(const msg::Extrinsics& extrinsics) {
  if (!extrinsics_.take(extrinsics)) return;
  context_.log().info("extrinsics version {} from now on", extrinsics_.version());
}

void TrackingComponent::on_map(const LocalMap& map) {
  const auto work = progress_.measure();
  if (map.header().frame_id() >= map_frame_id_) {  // one that was overtaken says nothing new
    map_frame_id_ = map.header().frame_id();
    if (!tracker_.update_map(conversion::read_local_map(map))) {
      context_.log().warn("mapping has a map that was there before: looking for the place in it");
      store_.clear();
    }
    send_again(map);
  }
  process_ready();
}

void TrackingComponent::send_again(const LocalMap& map) {
  const auto missing =
      store_.missing(map.next_keyframe_id(), map.header().frame_id(), last_frame_id_);
  for (const auto* keyframe : missing) publish_keyframe(*keyframe, resent_keyframes_);
  keyframes_sent_again_ += missing.size();
  context_.diagnostics().set("keyframes sent again", keyframes_sent_again_);
}

void TrackingComponent::on_answer(const Answer& answer) {
  const auto work = progress_.measure();
  const auto frame_id = answer.header().frame_id();
  if (frame_id == awaited_answer_) awaited_answer_ = 0;
  if (answer.found() == 0 || answer.keyframe_ids_count() == 0) {
    tracker_.relocalisation_failed(frame_id);
  } else {
    tracker_.relocalise({frame_id,
                         answer.map_epoch(),
                         answer.keyframe_ids()[0],
                         conversion::to_se3(answer.T_map_camera())});
  }
  process_ready();
}

void TrackingComponent::remember_rotation(const msg::Cloud& cloud) {
  const auto R_previous_camera =
      camera_rotation(cloud.rotation_imu(), extrinsics_.T_camera_imu().rotation());
  if (R_previous_camera) rotations_.add(cloud.header().frame_id(), *R_previous_camera);
}

void TrackingComponent::process_ready() {
  for (auto id = queue_.next(); id && may_process(); id = queue_.next()) {
    process(queue_.take(*id));
  }
}

bool TrackingComponent::may_process() const {
  if (awaited_answer_ != 0) return false;
  if (!config_.lockstep || !config_.wait_for_map) return true;
  if (last_frame_id_ == 0) return config_.load_map.empty() || !tracker_.map().empty();
  return map_frame_id_ >= last_frame_id_;
}

void TrackingComponent::process(const FrameInputs& inputs) {
  const double started_s = thread_processor_time_s();
  const auto header = (*inputs.image)->header();
  if (header.frame_id() <= last_frame_id_) begin_ids_anew();
  make_room();
  auto frame = make_frame(inputs);
  const auto R_previous_camera = frame.R_previous_camera;
  auto result = tracker_.track(std::move(frame));
  last_frame_id_ = header.frame_id();
  publish(result, thread_processor_time_s() - started_s);
  health_.add(result, R_previous_camera);
  report(result);
  progress_.done(header);
}

/// What is remembered by the ids of before would be taken for the future.
void TrackingComponent::begin_ids_anew() {
  context_.log().warn("frames count from 1 again: sync was started anew");
  last_frame_id_ = 0;
  map_frame_id_ = 0;
  rotations_ = {};
  tracker_.begin_ids_anew();
}

/// While mapping is away there is no end to the keyframes.
void TrackingComponent::make_room() {
  const auto gone = tracker_.thin_out(static_cast<std::size_t>(config_.keyframes_kept));
  if (!gone) return;
  store_.drop(*gone);
  if (keyframes_thinned_out_ == 0) {
    context_.log().warn(
        "mapping lacks {} keyframes (keyframes_kept): the older ones are thinned out",
        config_.keyframes_kept);
  }
  context_.diagnostics().set("keyframes thinned out", ++keyframes_thinned_out_);
}

tracking::Frame TrackingComponent::make_frame(const FrameInputs& inputs) {
  const auto& image = **inputs.image;
  tracking::Frame frame;
  frame.frame_id = image.header().frame_id();
  frame.stamp_ns = image.header().stamp_ns();
  const auto grey = conversion::grey_view(image);
  if (!grey) {
    throw std::runtime_error(
        "frame image without a grey plane: set sync's encoding to mono8 or "
        "yuv420");
  }
  depth::DepthView depth;
  if (inputs.depth && (*inputs.depth)->depth_m_count() > 0) {
    const auto& message = **inputs.depth;
    depth = {message.depth_m().data(),
             message.sigma_m().data(),
             static_cast<int>(message.width_px()),
             static_cast<int>(message.height_px())};
  }
  frame.features = builder_.build({grey->data,
                                   grey->width_px,
                                   grey->height_px,
                                   static_cast<std::ptrdiff_t>(grey->row_step_bytes)},
                                  depth);
  frame.R_previous_camera = rotations_.between(last_frame_id_, frame.frame_id);
  return frame;
}

void TrackingComponent::publish(tracking::FrameResult& result, double time_s) {
  if (result.keyframe) publish_keyframe(*result.keyframe, keyframes_);
  if (result.relocalisation_request) {
    publish_keyframe(*result.relocalisation_request, requests_);
    if (config_.lockstep && requests_.subscriber_count() > 0) awaited_answer_ = result.frame_id;
  }
  if (result.keyframe) ++keyframes_sent_;
  auto pose = poses_.loan();
  conversion::write_frame_pose(result, *pose);
  pose->processing_time_s(static_cast<float>(time_s));
  poses_.publish(std::move(pose));
  if (result.has_pose()) odometry_.publish(result);
  if (result.keyframe) store_.add(*std::move(result.keyframe));
}

void TrackingComponent::publish_keyframe(const tracking::Keyframe& keyframe,
                                         Publisher<msg::Keyframe>& publisher) {
  auto message = publisher.loan();
  if (!conversion::write_keyframe(keyframe, *message)) {
    context_.log().error("a frame of {} features does not fit a keyframe; lower frame.extractor",
                         keyframe.features.size());
    return;
  }
  publisher.publish(std::move(message));
}

void TrackingComponent::report(const tracking::FrameResult& result) {
  constexpr std::array kLevels = {HealthLevel::kOk, HealthLevel::kWarn, HealthLevel::kError};
  constexpr std::array kNames = {"waiting", "ok", "lost", "relocalising", "localisation only"};
  auto& diagnostics = context_.diagnostics();
  const auto& statistics = result.statistics;
  diagnostics.set("state", kNames.at(static_cast<std::size_t>(result.state)));
  const auto count = [&diagnostics](std::string_view key, int value) {
    diagnostics.set(key, static_cast<std::uint64_t>(value));
  };
  count("features", statistics.features);
  count("features with depth", statistics.features_with_depth);
  count("matches", statistics.matches);
  count("inliers", statistics.inliers);
  diagnostics.set("chi2 per row", statistics.chi2_per_row);
  diagnostics.set("keyframes", keyframes_sent_);
  diagnostics.set("dropped frames", queue_.dropped());
  diagnostics.set("landmarks", static_cast<std::uint64_t>(tracker_.map().landmarks().size()));
  count("banned landmarks", statistics.banned_landmarks);
  count("refused poses", statistics.refused_poses);
  const auto& health = health_.status();
  diagnostics.report(kLevels.at(static_cast<std::size_t>(health.level)), health.message);
}

}  // namespace camvox
