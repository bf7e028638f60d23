#include "camvox/import/simulated_bag.hpp"

#include <fmt/format.h>

#include <map>

#include "calibration_file.hpp"
#include "camvox/interfaces/topics.hpp"
#include "camvox/simulation/jpeg.hpp"
#include "camvox/simulation/loop_pairs.hpp"
#include "camvox/simulation/simulator.hpp"
#include "import_job.hpp"
#include "simulated_messages.hpp"
#include "text_file.hpp"

namespace camvox::import {
namespace {

namespace topics = interfaces::topics;
using geometry::SE3;
using simulation::SimulationOptions;

std::string tum_line(std::int64_t stamp_ns, const SE3& T) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const auto& p = T.translation();
  const auto& q = T.rotation().quaternion();
  return fmt::format("{}.{:09} {:.9f} {:.9f} {:.9f} {:.12f} {:.12f} {:.12f} {:.12f}\n",
                     stamp_ns / kSecond_ns,
                     stamp_ns % kSecond_ns,
                     p.x(),
                     p.y(),
                     p.z(),
                     q.x(),
                     q.y(),
                     q.z(),
                     q.w());
}

class Recording {
 public:
  Recording(const SimulationOptions& simulation, const SimulatedBagOptions& options)
      : job_(options, "simulated"),
        simulation_(simulation),
        options_(options),
        simulator_(simulation, options.threads, options.trajectory),
        T_camera_body_(simulator_.true_rig().T_body_camera.inverse()) {
    const auto& imu = simulation.imu;
    gyro_variance_ =
        imu.gyro_noise_rad_s_sqrt_hz * imu.gyro_noise_rad_s_sqrt_hz * simulation.imu_rate_hz;
    accel_variance_ =
        imu.accel_noise_m_s2_sqrt_hz * imu.accel_noise_m_s2_sqrt_hz * simulation.imu_rate_hz;
  }

  ImportReport run() {
    const auto start_ns = simulation_.start_stamp_ns;
    const auto span_ns = static_cast<std::uint64_t>(simulator_.duration_s() * 1e9);
    job_.write(
        topics::kStaticTransforms, start_ns, to_transforms(start_ns, simulator_.recorded_rig()));
    job_.write(kTruthTransformsTopic, start_ns, to_transforms(start_ns, simulator_.true_rig()));
    while (const auto event = simulator_.next()) {
      now_ns_ = event->arrival_ns;
      std::visit([this](const auto& message) { write(message); }, event->message);
      job_.progress(static_cast<std::uint64_t>(now_ns_ - start_ns), span_ns);
    }
    write_files();
    return job_.finish();
  }

 private:
  template <typename T>
  void send(std::string_view topic, const T& message) {
    job_.write(topic, now_ns_, message);
  }

  void write(const simulation::SimulatedFrame& frame) {
    send(topics::kCameraInfo, to_camera_info(frame.stamp_ns, simulation_.intrinsics));
    if (options_.raw_images) {
      send(topics::kImage, to_image(frame));
    } else {
      auto jpeg = simulation::encode_jpeg(frame.image, simulation_.camera.jpeg_quality);
      send(topics::kCompressedImage,
           make_compressed_image(frame.stamp_ns, "jpeg", std::move(jpeg)));
    }
    if (options_.truth_depth) send(kTruthDepthTopic, to_depth_image(frame));
    frames_[frame.index] = frame.stamp_ns;
    T_world_camera_.emplace(frame.stamp_ns, frame.T_world_camera);
  }

  void write(const simulation::LidarScan& scan) {
    send(topics::kLidar, to_livox(scan));
    if (options_.truth_points) send(kTruthPointsTopic, to_truth_points(scan));
    if (simulation_.images) return;
    const double time_s = 1e-9 * static_cast<double>(scan.stamp_ns - simulation_.start_stamp_ns);
    T_world_camera_.emplace(scan.stamp_ns,
                            simulator_.trajectory().pose(time_s) * T_camera_body_.inverse());
  }

  void write(const simulation::ImuSample& sample) {
    send(topics::kImu, to_imu(sample, gyro_variance_, accel_variance_));
    send(kTruthBiasTopic, to_bias(sample));
  }

  void write(const simulation::GnssSample& sample) { send(topics::kGnss, to_fix(sample)); }
  void write(const simulation::TruthState& truth) { send(kTruthOdometryTopic, to_odometry(truth)); }

  void write_files() {
    job_.write_file("simulation.yaml", config::to_yaml(config::dump(simulation_)));
    write_rig("rig.yaml", simulator_.recorded_rig());
    write_rig("truth_rig.yaml", simulator_.true_rig());
    std::string camera;
    std::string body;
    for (const auto& [stamp_ns, T] : T_world_camera_) {
      camera += tum_line(stamp_ns, T);
      body += tum_line(stamp_ns, T * T_camera_body_);
    }
    job_.write_file("truth_camera.tum", camera);
    job_.write_file("truth_body.tum", body);
    write_loop_pairs();
  }

  void write_rig(const std::string& name, const sensors::RigCalibration& rig) {
    job_.write_file(name, calibration_text(simulation_.intrinsics, sensors::to_config(rig)));
  }

  /// Of images that were sent; stamps stand for them, since readers count frames as they like.
  void write_loop_pairs() {
    std::string text = "earlier_stamp_ns,later_stamp_ns,distance_m,heading_difference_rad\n";
    for (const auto& pair :
         simulation::loop_pairs(simulator_.trajectory(), simulation_.camera.rate_hz)) {
      const auto earlier = frames_.find(pair.earlier_frame);
      const auto later = frames_.find(pair.later_frame);
      if (earlier == frames_.end() || later == frames_.end()) continue;
      text += fmt::format("{},{},{:.4f},{:.4f}\n",
                          earlier->second,
                          later->second,
                          pair.distance_m,
                          pair.heading_difference_rad);
    }
    job_.write_file("loop_pairs.csv", text);
  }

  ImportJob job_;
  const SimulationOptions& simulation_;
  const SimulatedBagOptions& options_;
  simulation::Simulator simulator_;
  SE3 T_camera_body_;
  double gyro_variance_ = 0.0;
  double accel_variance_ = 0.0;
  std::int64_t now_ns_ = 0;
  std::map<std::int64_t, std::int64_t> frames_;  ///< Stamps by index of the image.
  std::map<std::int64_t, SE3> T_world_camera_;   ///< By stamp: late images are sorted in.
};

}  // namespace

storage::Result<ImportReport> write_simulated_bag(const SimulationOptions& simulation,
                                                  const SimulatedBagOptions& options) {
  return guarded([&] { return Recording(simulation, options).run(); });
}

storage::Result<simulation::Trajectory> read_motion(const std::filesystem::path& tum_file,
                                                    const SE3& T_body_sensor) {
  constexpr double kKnotInterval_s = 0.1;
  const auto read = [&]() -> storage::Result<simulation::Trajectory> {
    TextFile file(tum_file);
    std::vector<simulation::TimedPose> poses;
    std::int64_t first_ns = 0;
    std::int64_t last_ns = -1;
    while (file.next()) {
      if (file.empty_line()) continue;
      const auto stamp_ns = file.seconds_as_ns(0);
      const auto v = file.numbers(1, 7);
      if (stamp_ns <= last_ns) file.fail("time does not increase");
      const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
      if (std::abs(rotation.norm() - 1.0) > 1e-3) file.fail("the quaternion's norm is not 1");
      if (poses.empty()) first_ns = stamp_ns;
      last_ns = stamp_ns;
      const SE3 T_first_sensor(geometry::SO3(rotation.normalized()), {v[0], v[1], v[2]});
      poses.push_back({1e-9 * static_cast<double>(stamp_ns - first_ns),
                       T_body_sensor * T_first_sensor * T_body_sensor.inverse()});
    }
    if (poses.size() < 2) file.fail("a motion needs two poses");
    return simulation::follow_poses(poses, kKnotInterval_s);
  };
  try {
    return read();
  } catch (const ImportError& error) {
    return storage::Status(error.code(), error.what());
  }
}

}  // namespace camvox::import
