#include "camvox/import/tum_rgbd.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration_file.hpp"
#include "camvox/interfaces/topics.hpp"
#include "image_file.hpp"
#include "import_job.hpp"
#include "messages.hpp"
#include "tum_lists.hpp"

namespace camvox::import {
namespace {

namespace fs = std::filesystem;
namespace topics = interfaces::topics;
constexpr const char* kAccelerometerTopic = "/imu/data_raw";

/// Of ROS, which TUM's own tools use as well when nothing better is known.
constexpr std::array<double, 9> kUnknownKinect = {525.0, 525.0, 319.5, 239.5, 0, 0, 0, 0, 0};

sensor_msgs::msg::Imu make_acceleration(const TumAcceleration& sample) {
  sensor_msgs::msg::Imu message;
  message.header(interfaces::to_header(sample.stamp_ns, kImuFrame));
  message.linear_acceleration(to_message(sample.acceleration_mps2));
  message.orientation().w(1.0);
  message.orientation_covariance()[0] = -1.0;  // absent
  message.angular_velocity_covariance()[0] = -1.0;
  return message;
}

class TumRgbdImport {
 public:
  TumRgbdImport(const fs::path& folder, const TumRgbdOptions& options)
      : job_(options, name_from(folder)),
        options_(options),
        lists_(read_tum_lists(folder, options.index_rate_hz, job_.report)) {
    choose_intrinsics(name_from(folder));
    add(lists_.color, [this](const TumFile& frame) { write_color(frame); });
    add(lists_.depth, [this](const TumFile& frame) { write_depth(frame); });
    add(lists_.poses, [this](const TumPose& pose) {
      job_.write(kGroundTruthTopic,
                 pose.stamp_ns,
                 make_odometry(pose.stamp_ns, kCameraFrame, pose.T_map_camera));
    });
    add(lists_.accelerations, [this](const TumAcceleration& sample) {
      job_.write(kAccelerometerTopic, sample.stamp_ns, make_acceleration(sample));
    });
    std::ranges::stable_sort(events_, {}, &Event::time_ns);
  }

  ImportReport run() {
    if (!events_.empty()) write_static_transforms(events_.front().time_ns);
    for (std::size_t i = 0; i < events_.size(); ++i) {
      job_.progress(i, events_.size());
      events_[i].write();
    }
    job_.progress(events_.size(), events_.size());
    if (!lists_.depth.empty()) {
      job_.report.notes.push_back(
          fmt::format("depth: {:g} units a metre, as 16UC1 in mm", options_.depth_units_per_m));
    }
    job_.write_file("rig.yaml", calibration_text(to_intrinsics(camera_), camera_only_rig()));
    return job_.finish();
  }

 private:
  struct Event {
    std::int64_t time_ns;
    std::function<void()> write;
  };

  template <typename Item, typename Function>
  void add(const std::vector<Item>& items, Function write) {
    for (const auto& item : items) {
      events_.push_back({item.stamp_ns, [&item, write] { write(item); }});
    }
  }

  void choose_intrinsics(const std::string& name) {
    auto values = options_.intrinsics;
    auto& notes = job_.report.notes;
    if (!values && (values = tum_intrinsics(name))) {
      notes.push_back("camera_info: intrinsics by the name of the folder");
    } else if (!values) {
      values = kUnknownKinect;
      notes.push_back("camera_info: the name of the folder tells no camera; a Kinect's default");
    }
    camera_.fx_px = (*values)[0];
    camera_.fy_px = (*values)[1];
    camera_.cx_px = (*values)[2];
    camera_.cy_px = (*values)[3];
    camera_.plumb_bob.assign(values->begin() + 4, values->end());
  }

  void write_color(const TumFile& frame) {
    auto image = read_encoded_image(frame.file);
    camera_.width_px = image.width_px;
    camera_.height_px = image.height_px;
    job_.write(topics::kCameraInfo, frame.stamp_ns, make_camera_info(frame.stamp_ns, camera_));
    job_.write(topics::kCompressedImage,
               frame.stamp_ns,
               make_compressed_image(frame.stamp_ns, image.format, std::move(image.bytes)));
  }

  void write_depth(const TumFile& frame) {
    auto depth = read_png16(frame.file);
    const double mm_per_unit = 1e3 / options_.depth_units_per_m;
    for (auto& pixel : depth.pixels) {
      pixel = static_cast<std::uint16_t>(std::lround(pixel * mm_per_unit));
    }
    job_.write(kDepthTopic,
               frame.stamp_ns,
               make_depth_image(frame.stamp_ns, depth.width_px, depth.height_px, depth.pixels));
  }

  void write_static_transforms(std::int64_t stamp_ns) {
    tf2_msgs::msg::TFMessage message;
    message.transforms().push_back(
        make_transform(stamp_ns, kBaseFrame, kCameraFrame, T_body_optical()));
    job_.write(topics::kStaticTransforms, stamp_ns, message);
  }

  ImportJob job_;
  TumRgbdOptions options_;
  TumLists lists_;
  CameraModel camera_;
  std::vector<Event> events_;
};

}  // namespace

// As published: TUM's page on file formats, calibration of each camera; ICL-NUIM's page, where fy
// is negative.
std::optional<std::array<double, 9>> tum_intrinsics(const std::string& name) {
  const auto has = [&](const char* part) { return name.find(part) != std::string::npos; };
  if (has("freiburg1") || has("fr1")) {
    return {{517.3, 516.5, 318.6, 255.3, 0.2624, -0.9531, -0.0054, 0.0026, 1.1633}};
  }
  if (has("freiburg2") || has("fr2")) {
    return {{520.9, 521.0, 325.1, 249.7, 0.2312, -0.7849, -0.0033, -0.0001, 0.9172}};
  }
  if (has("freiburg3") || has("fr3")) return {{535.4, 539.2, 320.1, 247.6, 0, 0, 0, 0, 0}};
  if (has("icl") || has("living_room") || has("office")) {
    return {{481.2, -480.0, 319.5, 239.5, 0, 0, 0, 0, 0}};
  }
  return std::nullopt;
}

storage::Result<ImportReport> import_tum_rgbd(const fs::path& folder,
                                              const TumRgbdOptions& options) {
  return guarded([&] {
    if (!fs::is_directory(folder)) fail_corrupt(folder, "is no folder");
    if (!(options.depth_units_per_m >= 1000.0) || !(options.index_rate_hz > 0.0)) {
      throw ImportError(storage::StatusCode::kInvalid,
                        "depth has at least 1000 units a metre, and the frame rate is positive");
    }
    return TumRgbdImport(folder, options).run();
  });
}

}  // namespace camvox::import
