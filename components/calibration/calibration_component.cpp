#include "camvox/calibration_component/calibration_component.hpp"

#include <cstring>

#include "camvox/calibration_component/rig_file.hpp"
#include "camvox/conversion/image.hpp"
#include "camvox/conversion/pose.hpp"

namespace camvox {
namespace {

constexpr std::size_t kMaxPoints = 2'000'000;
constexpr std::string_view kRequestTopic = "/camvox/calibrate";

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

CalibrationComponent::CalibrationComponent(Context& context)
    : context_(context),
      config_(context.parameters<CalibrationComponentConfig>()),
      rig_(sensors::make_rig_calibration(config_.rig)),
      T_camera_lidar_(rig_.T_camera_lidar()),
      extrinsics_(context.advertise<Extrinsics>({"extrinsics", topics::kExtrinsics},
                                                {.qos = qos::kState})) {
  if (auto problems = sensors::check(config_.camera); !problems.empty()) {
    throw config::ConfigError(std::move(problems));
  }
  context.subscribe<FrameImage>({"frame_image", topics::kFrameImage},
                                [this](const auto& image) { on_image(*image); },
                                {.qos = qos::kFrames});
  context.subscribe<Cloud>({"cloud", topics::kCloud},
                           [this](const auto& cloud) { on_cloud(*cloud); },
                           {.qos = qos::kFrames});
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

bool CalibrationComponent::wanted(std::int64_t stamp_ns) const {
  if (!standing_ || done_here_ || job_.busy()) return false;
  if (requested_) return true;
  const auto interval_ns = static_cast<std::int64_t>(1e9 * config_.min_interval_s);
  return config_.automatic && (!last_run_ns_ || stamp_ns - *last_run_ns_ >= interval_ns);
}

void CalibrationComponent::on_image(const FrameImage& image) {
  if (!wanted(image.header().stamp_ns()) || !scene_.image.empty()) return;
  if (!conversion::is_well_formed(image)) return;
  scene_.image = copy_of(image);
}

void CalibrationComponent::on_cloud(const Cloud& cloud) {
  if (cloud.stationary() == 0) return on_motion();
  standing_ = true;
  if (!wanted(cloud.header().stamp_ns())) return;
  if (!first_ns_) first_ns_ = cloud.header().stamp_ns();
  for (std::uint32_t i = 0; i < cloud.points_count(); ++i) {
    if (scene_.points_lidar.size() >= kMaxPoints) break;
    scene_.points_lidar.emplace_back(cloud.points()[i].data());
  }
  const auto collected_s = 1e-9 * static_cast<double>(cloud.header().stamp_ns() - *first_ns_);
  if (collected_s >= config_.collect_s && !scene_.image.empty()) start_job(cloud.header());
}

void CalibrationComponent::on_motion() {
  standing_ = false;
  done_here_ = false;
  first_ns_.reset();
  scene_ = {};
  if (!job_.busy()) return;
  job_.cancel();
  ++run_;
  context_.diagnostics().set("cancelled by motion", ++cancelled_);
  context_.diagnostics().report(HealthLevel::kOk, "cancelled by motion");
}

void CalibrationComponent::start_job(const camvox_interfaces::msg::MessageHeader& header) {
  context_.diagnostics().report(HealthLevel::kOk, "calibrating");
  header_ = header;
  last_run_ns_ = header.stamp_ns();
  done_here_ = true;
  job_.start({std::exchange(scene_, {}),
              config_.camera,
              T_camera_lidar_,
              config_.calibration,
              config_.overlay_folder},
             [this, run = ++run_](const calibration::CalibrationResult& result) {
               context_.post([this, run, result] { finish(run, result); });
             });
  first_ns_.reset();
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
  auto& diagnostics = context_.diagnostics();
  diagnostics.set("score before", result.score_before);
  diagnostics.set("score after", result.score_after);
  diagnostics.set("inlier share", result.inlier_share);
  diagnostics.set("disagreement of halves deg", result.disagreement_deg);
  diagnostics.set("sigma deg", result.sigma_rotation_deg);
  diagnostics.set("accepted", accepted_);
  diagnostics.set("refused", refused_);
  diagnostics.report(HealthLevel::kOk, result.accepted ? "accepted" : "refused: " + result.reason);
}

void CalibrationComponent::publish(const calibration::CalibrationResult& result) {
  Extrinsics message;
  message.header(header_);
  message.version(version_ + 1);
  message.T_camera_lidar(conversion::to_array(result.T_camera_lidar));
  message.covariance_lidar(conversion::to_array(result.covariance_lidar));
  message.cost_before(-result.held_back_before);
  message.cost_after(-result.held_back_after);
  message.applied(result.accepted ? 1 : 0);
  extrinsics_.publish(message);
  if (!result.accepted) {
    ++refused_;
    // Late readers get the last message: it must be the one in force.
    if (in_force_) extrinsics_.publish(*in_force_);
    return;
  }
  ++accepted_;
  ++version_;
  in_force_ = message;
  T_camera_lidar_ = result.T_camera_lidar;
  if (!config_.rig_file.empty()) save_rig();
}

void CalibrationComponent::save_rig() {
  // The camera stays where it is on the robot; the lidar, and the IMU with it, move.
  rig_.T_lidar_camera = T_camera_lidar_.inverse();
  const std::string problem = calibration_component::write_rig_file(
      config_.rig_file,
      calibration_component::rig_file_text(config_.camera, sensors::to_config(rig_)));
  if (!problem.empty()) context_.log().error("{}", problem);
}

}  // namespace camvox
