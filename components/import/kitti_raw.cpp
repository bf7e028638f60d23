#include "camvox/import/kitti_raw.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "calibration_file.hpp"
#include "camvox/interfaces/topics.hpp"
#include "image_file.hpp"
#include "import_job.hpp"
#include "kitti_calibration.hpp"
#include "kitti_layout.hpp"
#include "kitti_oxts.hpp"
#include "text_file.hpp"

namespace camvox::import {
namespace {

namespace fs = std::filesystem;
namespace topics = interfaces::topics;
constexpr const char* kLidarFrame = "velodyne";
constexpr const char* kLidarTopic = "/velodyne_points";
constexpr const char* kImuTopic = "/imu/data";

/// The points of a file with the time of each, if the sweep is known.
sensor_msgs::msg::PointCloud2 make_cloud(std::int64_t stamp_ns,
                                         const fs::path& file,
                                         const std::optional<SweepTimes>& sweep) {
  constexpr std::size_t kStored = 4 * sizeof(float);
  const auto bytes = read_bytes(file);
  if (bytes.size() % kStored != 0) fail_corrupt(file, "ends inside a point (16 bytes each)");
  const std::size_t count = bytes.size() / kStored;
  const std::size_t step = kStored + (sweep ? sizeof(float) : 0);
  sensor_msgs::msg::PointCloud2 cloud;
  cloud.header(interfaces::to_header(stamp_ns, kLidarFrame));
  cloud.height(1);
  cloud.width(static_cast<std::uint32_t>(count));
  for (const auto* name : {"x", "y", "z", "intensity", "time"}) {
    const auto offset = static_cast<std::uint32_t>(cloud.fields().size() * sizeof(float));
    if (offset < step) cloud.fields().push_back(float_field(name, offset));
  }
  cloud.point_step(static_cast<std::uint32_t>(step));
  cloud.row_step(static_cast<std::uint32_t>(step * count));
  cloud.is_dense(true);
  cloud.data().resize(step * count);
  for (std::size_t i = 0; i < count; ++i) {
    auto* point = &cloud.data()[i * step];
    std::memcpy(point, &bytes[i * kStored], kStored);
    if (!sweep) continue;
    float xy[2];
    std::memcpy(xy, point, sizeof(xy));
    if (!std::isfinite(xy[0]) || !std::isfinite(xy[1]))
      fail_corrupt(file, "has a point that is no number");
    const auto time_s = static_cast<float>(
        1e-9 * static_cast<double>(sweep_time_ns(*sweep, std::atan2(xy[1], xy[0]))));
    std::memcpy(point + kStored, &time_s, sizeof(time_s));
  }
  return cloud;
}

class KittiImport {
 public:
  KittiImport(const KittiFolders& folders, const KittiRawOptions& options)
      : job_(options, name_from(folders.drive)),
        calibration_(read_kitti_calibration(folders.calibration, options.camera, job_.report)) {
    add_images(folders.drive / fmt::format("image_{:02}", options.camera));
    add_clouds(folders.drive / "velodyne_points");
    add_oxts(folders.drive / "oxts");
    for (const auto& entry : fs::directory_iterator(folders.drive))
      add_unused(entry, options.camera);
    std::ranges::stable_sort(events_, {}, &Event::time_ns);
  }

  ImportReport run() {
    if (!events_.empty()) write_static_transforms(events_.front().time_ns);
    for (std::size_t i = 0; i < events_.size(); ++i) {
      job_.progress(i, events_.size());
      events_[i].write();
    }
    job_.progress(events_.size(), events_.size());
    write_rig();
    return job_.finish();
  }

 private:
  struct Event {
    std::int64_t time_ns;  ///< When a recorder would have got it.
    std::function<void()> write;
  };

  void add_images(const fs::path& sensor) {
    for (const auto& frame : list_kitti_frames(sensor, {".png", ".jpg", ".jpeg"}, job_.report)) {
      events_.push_back({frame.stamp_ns, [this, frame] { write_image(frame); }});
    }
  }

  void write_image(const KittiFrame& frame) {
    auto image = read_encoded_image(frame.file);
    if (const auto& camera = calibration_.camera; camera) {
      if (image.width_px != camera->width_px || image.height_px != camera->height_px) {
        fail_corrupt(frame.file,
                     fmt::format("is {}x{}, the calibration says {}x{}",
                                 image.width_px,
                                 image.height_px,
                                 camera->width_px,
                                 camera->height_px));
      }
      job_.write(topics::kCameraInfo, frame.stamp_ns, make_camera_info(frame.stamp_ns, *camera));
    }
    job_.write(topics::kCompressedImage,
               frame.stamp_ns,
               make_compressed_image(frame.stamp_ns, image.format, std::move(image.bytes)));
  }

  void add_clouds(const fs::path& sensor) {
    const auto frames = list_kitti_frames(sensor, {".bin"}, job_.report);
    if (frames.empty()) return;
    std::vector<std::optional<std::int64_t>> starts, ends;
    if (fs::exists(sensor / "timestamps_start.txt") && fs::exists(sensor / "timestamps_end.txt")) {
      starts = read_kitti_stamps(sensor / "timestamps_start.txt");
      ends = read_kitti_stamps(sensor / "timestamps_end.txt");
    }
    std::uint64_t timed = 0;
    for (const auto& frame : frames) {
      const auto sweep = sweep_of(frame, starts, ends);
      timed += sweep ? 1 : 0;
      const auto stamp_ns = sweep ? sweep->start_ns : frame.stamp_ns;
      events_.push_back({sweep ? sweep->end_ns : frame.stamp_ns, [this, frame, sweep, stamp_ns] {
                           const auto cloud = make_cloud(stamp_ns, frame.file, sweep);
                           const auto log_time_ns = sweep ? sweep->end_ns : stamp_ns;
                           job_.write(kLidarTopic, log_time_ns, cloud);
                         }});
    }
    report_times(timed, frames.size());
  }

  static std::optional<SweepTimes> sweep_of(const KittiFrame& frame,
                                            const std::vector<std::optional<std::int64_t>>& starts,
                                            const std::vector<std::optional<std::int64_t>>& ends) {
    if (frame.number >= starts.size() || frame.number >= ends.size()) return std::nullopt;
    if (!starts[frame.number] || !ends[frame.number]) return std::nullopt;
    const SweepTimes sweep{*starts[frame.number], frame.stamp_ns, *ends[frame.number]};
    const bool ordered = sweep.start_ns < sweep.forward_ns && sweep.forward_ns < sweep.end_ns;
    return ordered ? std::optional(sweep) : std::nullopt;
  }

  void report_times(std::uint64_t timed, std::uint64_t clouds) {
    auto& report = job_.report;
    if (timed > 0) {
      report.notes.push_back(
          "velodyne_points: time of each point from its azimuth between start, forward and end of "
          "the sweep (clockwise, from behind); stamp: start, logged at the end");
    }
    if (timed < clouds) {
      report.missing.push_back(
          fmt::format("velodyne_points: start and end of {} sweeps, whose points have no time",
                      clouds - timed));
    }
  }

  void add_oxts(const fs::path& sensor) {
    const auto frames = list_kitti_frames(sensor, {".txt"}, job_.report);
    for (const auto& frame : frames) {
      events_.push_back({frame.stamp_ns, [this, frame] { write_oxts(frame); }});
    }
    if (frames.size() < 2) return;
    const auto span_s =
        1e-9 * static_cast<double>(frames.back().stamp_ns - frames.front().stamp_ns);
    job_.report.notes.push_back(fmt::format(
        "oxts: {:.0f} Hz (synced recordings keep one sample a frame); ground truth is relative to "
        "the first fix",
        static_cast<double>(frames.size() - 1) / span_s));
  }

  void write_oxts(const KittiFrame& frame) {
    const auto sample = read_oxts(frame.file);
    job_.write(kImuTopic, frame.stamp_ns, to_imu(frame.stamp_ns, sample));
    job_.write(topics::kGnss, frame.stamp_ns, to_fix(frame.stamp_ns, sample));
    job_.write(kGroundTruthTopic, frame.stamp_ns, truth_.to_odometry(frame.stamp_ns, sample));
  }

  void add_unused(const fs::directory_entry& entry, int camera) {
    const auto name = entry.path().filename().string();
    if (name == "velodyne_points" || name == "oxts" || name == fmt::format("image_{:02}", camera)) {
      return;
    }
    job_.report.left_out.push_back(
        {name, 1, name.starts_with("image_") ? "another camera was chosen" : "no topic for it"});
  }

  /// The body is the IMU: OXTS gives its poses.
  void write_rig() {
    if (!calibration_.camera || !calibration_.T_imu_lidar || !calibration_.T_lidar_camera) return;
    const auto to_se3 = [](const Eigen::Isometry3d& T) {
      return geometry::SE3::from_matrix(T.matrix());
    };
    sensors::RigCalibration rig;
    rig.T_lidar_camera = to_se3(*calibration_.T_lidar_camera);
    rig.T_imu_lidar = to_se3(*calibration_.T_imu_lidar);
    rig.T_body_camera = rig.T_imu_lidar * rig.T_lidar_camera;
    job_.write_file("rig.yaml",
                    calibration_text(to_intrinsics(*calibration_.camera), sensors::to_config(rig)));
  }

  void write_static_transforms(std::int64_t stamp_ns) {
    tf2_msgs::msg::TFMessage message;
    const auto add = [&](const char* parent, const char* child, const Eigen::Isometry3d& T) {
      message.transforms().push_back(make_transform(stamp_ns, parent, child, T));
    };
    add(kBaseFrame, kImuFrame, Eigen::Isometry3d::Identity());
    if (calibration_.T_imu_lidar) add(kImuFrame, kLidarFrame, *calibration_.T_imu_lidar);
    if (calibration_.T_lidar_camera) add(kLidarFrame, kCameraFrame, *calibration_.T_lidar_camera);
    job_.write(topics::kStaticTransforms, stamp_ns, message);
  }

  ImportJob job_;
  KittiCalibration calibration_;
  OxtsGroundTruth truth_;
  std::vector<Event> events_;
};

}  // namespace

std::int64_t sweep_time_ns(const SweepTimes& sweep, double azimuth_rad) {
  const double part = azimuth_rad / std::numbers::pi;  // 1 at the start, 0 forward, -1 at the end
  const auto half_ns =
      part > 0.0 ? sweep.forward_ns - sweep.start_ns : sweep.end_ns - sweep.forward_ns;
  return sweep.forward_ns - sweep.start_ns - std::llround(part * static_cast<double>(half_ns));
}

storage::Result<ImportReport> import_kitti_raw(const fs::path& folder,
                                               const KittiRawOptions& options) {
  return guarded([&] {
    if (options.camera < 0 || options.camera > 3) {
      throw ImportError(storage::StatusCode::kInvalid, "the camera is 0, 1, 2 or 3");
    }
    return KittiImport(find_kitti_folders(folder, options.drive), options).run();
  });
}

}  // namespace camvox::import
