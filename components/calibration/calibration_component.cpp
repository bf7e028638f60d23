#include "camvox/calibration_component/calibration_component.hpp"

#include <filesystem>
#include <iterator>
#include <utility>

#include "camvox/calibration_component/rig_file.hpp"
#include "camvox/conversion/pose.hpp"

namespace camvox {
namespace {

/// Frames of which one half waits for the other: as many as a lockstep replay has under way.
constexpr std::size_t kFramesKept = 8;
constexpr std::string_view kRequestTopic = "/camvox/calibrate";

}  // namespace

CalibrationComponent::CalibrationComponent(Context& context)
    : context_(context),
      config_(context.parameters<CalibrationComponentConfig>()),
      rig_(sensors::make_rig_calibration(config_.rig)),
      T_camera_lidar_(rig_.T_camera_lidar()),
      progress_(context),
      extrinsics_(context.advertise<Extrinsics>({"extrinsics", topics::kExtrinsics},
                                                {.qos = qos::kState})) {
  if (auto problems = sensors::check(config_.camera); !problems.empty()) {
    throw config::ConfigError(std::move(problems));
  }
  if (const auto* extrinsics = std::any_cast<Extrinsics>(context.restart_memory()))
    put_in_force(*extrinsics);
  const SubscribeOptions frames{.qos = qos::kFrames, .max_held = kFramesKept};
  context.subscribe<FrameImage>(
      {"frame_image", topics::kFrameImage},
      [this](const auto& image) { keep(images_, image); },
      frames);
  context.subscribe<Cloud>(
      {"cloud", topics::kCloud},
      [this](const auto& cloud) {
        if (cloud->stationary() == 0) cancel();
        keep(clouds_, cloud);
      },
      frames);
  context.subscribe<std_msgs::msg::Header>({"calibrate", kRequestTopic},
                                           [this](const auto&) {
                                             requested_ = true;
                                             done_here_ = false;
                                           },
                                           {.required = false});
  context.on_parameter_change<CalibrationComponentConfig>(
      config_, [this](const CalibrationComponentConfig& next) {
        requested_ = requested_ || next.request != config_.request;
        if (requested_) done_here_ = false;
        config_ = next;
      });
  context.diagnostics().report(HealthLevel::kOk, "waiting for a standstill");
}

/// What was latched is gone with who published it: a component that comes now must get it, too.
void CalibrationComponent::start() {
  if (!in_force_) return;
  extrinsics_.publish(*in_force_);
  context_.log().info("extrinsics version {} stay in force", in_force_->version());
}

/// The camera stays where it is on the robot; the lidar, and the IMU with it, move.
void CalibrationComponent::put_in_force(const Extrinsics& extrinsics) {
  in_force_ = extrinsics;
  T_camera_lidar_ = conversion::to_se3(extrinsics.T_camera_lidar());
  rig_.T_lidar_camera = T_camera_lidar_.inverse();
  if (auto* memory = context_.restart_memory()) *memory = extrinsics;
}

template <typename Message>
void CalibrationComponent::keep(std::map<std::uint64_t, Sample<Message>>& frames,
                                const Sample<Message>& sample) {
  const auto work = progress_.measure();
  const auto frame_id = sample->header().frame_id();
  frames.insert_or_assign(frame_id, sample);
  while (frames.size() >= kFramesKept) frames.erase(frames.begin());
  const auto image = images_.find(frame_id);
  const auto cloud = clouds_.find(frame_id);
  if (image == images_.end() || cloud == clouds_.end()) return;
  const auto header = cloud->second->header();
  add(*image->second, *cloud->second);
  images_.erase(images_.begin(), std::next(image));
  clouds_.erase(clouds_.begin(), std::next(cloud));
  progress_.done(header);
}

bool CalibrationComponent::wanted(std::int64_t stamp_ns) const {
  if (done_here_ || job_.busy()) return false;
  if (requested_) return true;
  if (!config_.automatic) return false;
  if (!last_run_ns_ || stamp_ns < *last_run_ns_) return true;  // before it: the clock was set back
  return stamp_ns - *last_run_ns_ >= static_cast<std::int64_t>(1e9 * config_.min_interval_s);
}

void CalibrationComponent::add(const FrameImage& image, const Cloud& cloud) {
  const auto stamp_ns = cloud.header().stamp_ns();
  const bool standing = cloud.stationary() != 0;
  if (!standing) done_here_ = false;
  if (!standing || !wanted(stamp_ns)) return scene_.clear();
  scene_.add(image, cloud);
  if (scene_.is_complete(config_.collect_s)) calibrate(cloud.header());
}

void CalibrationComponent::cancel() {
  if (!job_.busy()) return;
  job_.cancel();
  ++run_;
  context_.diagnostics().set("cancelled by motion", ++cancelled_);
  context_.diagnostics().report(HealthLevel::kOk, "cancelled by motion");
}

void CalibrationComponent::calibrate(const camvox_interfaces::msg::MessageHeader& header) {
  context_.diagnostics().report(HealthLevel::kOk, "calibrating");
  header_ = header;
  last_run_ns_ = header.stamp_ns();
  done_here_ = true;
  calibration_component::CalibrationTask task{
      scene_.take(), config_.camera, T_camera_lidar_, config_.calibration, config_.output_dir};
  if (config_.lockstep) return finish(++run_, calibration_component::perform(task));
  job_.start(std::move(task), [this, run = ++run_](const calibration::CalibrationResult& result) {
    context_.post([this, run, result] { finish(run, result); });
  });
}

void CalibrationComponent::finish(std::uint64_t run, const calibration::CalibrationResult& result) {
  if (run != run_) return;  // cancelled, whatever it found
  requested_ = false;
  if (result.status != calibration::CalibrationStatus::kDone) {
    context_.log().warn("no calibration: {}", result.reason);
    return context_.diagnostics().report(HealthLevel::kWarn, result.reason);
  }
  context_.log().info("{}", calibration::report_text(result));
  publish(result);
  save(result);
  auto& diagnostics = context_.diagnostics();
  diagnostics.set("score before", result.score_before);
  diagnostics.set("score after", result.score_after);
  diagnostics.set("inlier share", result.inlier_share);
  diagnostics.set("disagreement of halves deg", result.disagreement_deg);
  diagnostics.set("sigma deg", result.sigma_rotation_deg);
  diagnostics.set("accepted", accepted_);
  diagnostics.set("refused", refused_);
  const auto* accepted = config_.lockstep ? "passed the gate, proposed" : "accepted";
  diagnostics.report(HealthLevel::kOk, result.accepted ? accepted : "refused: " + result.reason);
}

void CalibrationComponent::publish(const calibration::CalibrationResult& result) {
  Extrinsics message;
  message.header(header_);
  message.version(in_force_ ? in_force_->version() + 1 : 1);
  message.T_camera_lidar(conversion::to_array(result.T_camera_lidar));
  message.covariance_lidar(conversion::to_array(result.covariance_lidar));
  message.cost_before(-result.held_back_before);
  message.cost_after(-result.held_back_after);
  const bool applied = result.accepted && !config_.lockstep;
  message.applied(applied ? 1 : 0);
  extrinsics_.publish(message);
  ++(result.accepted ? accepted_ : refused_);
  if (applied) {
    put_in_force(message);
  } else if (in_force_) {
    // Late readers get the last message: it must be the one in force.
    extrinsics_.publish(*in_force_);
  }
}

void CalibrationComponent::save(const calibration::CalibrationResult& result) {
  auto rig = rig_;
  if (result.accepted) rig.T_lidar_camera = result.T_camera_lidar.inverse();
  const auto text = calibration_component::rig_file_text(config_.camera, sensors::to_config(rig));
  const auto write = [&](const std::filesystem::path& path, const std::string& content) {
    const auto problem = calibration_component::write_rig_file(path, content);
    if (!problem.empty()) context_.log().error("{}", problem);
  };
  if (!config_.output_dir.empty()) {
    write(std::filesystem::path(config_.output_dir) / "calibration.yaml",
          calibration_component::as_comment(calibration::report_text(result)) + text);
  }
  if (!config_.rig_file.empty() && result.accepted) write(config_.rig_file, text);
}

}  // namespace camvox
