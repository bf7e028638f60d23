#include "camvox/import/seven_scenes.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <map>

#include "calibration_file.hpp"
#include "camvox/interfaces/topics.hpp"
#include "image_file.hpp"
#include "import_job.hpp"
#include "messages.hpp"
#include "text_file.hpp"

namespace camvox::import {
namespace {

namespace fs = std::filesystem;
namespace topics = interfaces::topics;
constexpr const char* kDepthFrame = "camera_depth_optical_frame";

struct SceneFrame {
  fs::path color;
  fs::path depth;
  fs::path pose;
};

/// The number of "frame-000012.color.png"; none for other names.
std::optional<unsigned> frame_number(const std::string& name) {
  constexpr std::string_view kPrefix = "frame-";
  if (!name.starts_with(kPrefix)) return std::nullopt;
  unsigned number = 0;
  const auto [end, error] =
      std::from_chars(name.data() + kPrefix.size(), name.data() + name.size(), number);
  return error == std::errc() && *end == '.' ? std::optional(number) : std::nullopt;
}

/// The files by frame; names that are no part of a frame are left out.
std::map<unsigned, SceneFrame> list_frames(const fs::path& folder, ImportReport& report) {
  std::map<unsigned, SceneFrame> frames;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const auto name = entry.path().filename().string();
    const auto number = frame_number(name);
    const auto part = number ? name.substr(name.find('.')) : std::string();
    if (part == ".color.png" || part == ".color.jpg") {
      frames[*number].color = entry;
    } else if (part == ".depth.png") {
      frames[*number].depth = entry;
    } else if (part == ".pose.txt") {
      frames[*number].pose = entry;
    } else {
      report.left_out.push_back({name, 1, "no part of a frame"});
    }
  }
  return frames;
}

Eigen::Isometry3d read_pose(const fs::path& path) {
  TextFile file(path);
  Eigen::Matrix4d matrix;
  for (int row = 0; row < 4; ++row) {
    if (!file.next()) fail_corrupt(path, "has fewer than 4 lines");
    matrix.row(row) = Eigen::RowVector4d::Map(file.numbers(0, 4).data());
  }
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  if ((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-2 ||
      rotation.determinant() < 0.0 || matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    fail_corrupt(path, "is no pose: rotation, position, last row 0 0 0 1");
  }
  Eigen::Isometry3d T(Eigen::Quaterniond(rotation).normalized());
  T.pretranslate(Eigen::Vector3d(matrix.topRightCorner<3, 1>()));
  return T;
}

class SevenScenesImport {
 public:
  SevenScenesImport(const fs::path& folder, const SevenScenesOptions& options)
      : job_(options, name_from(folder)), options_(options) {
    T_camera_depth_.translation() = Eigen::Vector3d::Map(options.rig.p_camera_depth_m.data());
    camera_ = {options.rig.camera.width_px,
               options.rig.camera.height_px,
               options.rig.camera.fx_px,
               options.rig.camera.fy_px,
               options.rig.camera.cx_px,
               options.rig.camera.cy_px};
    frames_ = list_frames(folder, job_.report);
  }

  ImportReport run() {
    if (!frames_.empty()) write_static_transforms(stamp_ns(frames_.begin()->first));
    std::uint64_t done = 0;
    for (const auto& [number, frame] : frames_) {
      job_.progress(done++, frames_.size());
      write(number, frame);
    }
    job_.progress(done, done);
    report_missing();
    job_.report.notes.push_back(fmt::format(
        "frame i is at i/{:g} s; depth (f {:g}) is registered to colour (f {:g}), offset {:g} {:g} "
        "{:g} m, 16UC1 in mm",
        options_.frame_rate_hz,
        options_.rig.depth.fx_px,
        options_.rig.camera.fx_px,
        options_.rig.p_camera_depth_m[0],
        options_.rig.p_camera_depth_m[1],
        options_.rig.p_camera_depth_m[2]));
    job_.write_file("rig.yaml", calibration_text(to_intrinsics(camera_), camera_only_rig()));
    return job_.finish();
  }

 private:
  [[nodiscard]] std::int64_t stamp_ns(unsigned number) const {
    return std::llround(1e9 * number / options_.frame_rate_hz);
  }

  void write(unsigned number, const SceneFrame& frame) {
    const auto time_ns = stamp_ns(number);
    if (!frame.color.empty()) write_color(time_ns, frame.color);
    if (!frame.depth.empty()) write_depth(time_ns, frame.depth);
    if (!frame.pose.empty()) write_pose(time_ns, frame.pose);
    without_color_ += frame.color.empty() ? 1 : 0;
    without_depth_ += frame.depth.empty() ? 1 : 0;
    without_pose_ += frame.pose.empty() ? 1 : 0;
  }

  void write_color(std::int64_t time_ns, const fs::path& path) {
    auto image = read_encoded_image(path);
    check_size(path, image.width_px, image.height_px, options_.rig.camera);
    job_.write(topics::kCameraInfo, time_ns, make_camera_info(time_ns, camera_));
    job_.write(topics::kCompressedImage,
               time_ns,
               make_compressed_image(time_ns, image.format, std::move(image.bytes)));
  }

  void write_depth(std::int64_t time_ns, const fs::path& path) {
    const auto depth = read_png16(path);
    check_size(path, depth.width_px, depth.height_px, options_.rig.depth);
    const auto registered = register_depth(options_.rig, depth.pixels);
    job_.write(kDepthTopic,
               time_ns,
               make_depth_image(time_ns, camera_.width_px, camera_.height_px, registered));
  }

  void write_pose(std::int64_t time_ns, const fs::path& path) {
    const auto T_map_camera = read_pose(path) * T_camera_depth_.inverse();
    job_.write(kGroundTruthTopic, time_ns, make_odometry(time_ns, kCameraFrame, T_map_camera));
  }

  static void check_size(const fs::path& path, int width_px, int height_px, const Pinhole& camera) {
    if (width_px == camera.width_px && height_px == camera.height_px) return;
    fail_corrupt(path,
                 fmt::format("is {}x{}, the camera has {}x{}",
                             width_px,
                             height_px,
                             camera.width_px,
                             camera.height_px));
  }

  void write_static_transforms(std::int64_t time_ns) {
    tf2_msgs::msg::TFMessage message;
    message.transforms().push_back(
        make_transform(time_ns, kBaseFrame, kCameraFrame, T_body_optical()));
    message.transforms().push_back(
        make_transform(time_ns, kCameraFrame, kDepthFrame, T_camera_depth_));
    job_.write(topics::kStaticTransforms, time_ns, message);
  }

  void report_missing() {
    const auto say = [&](std::uint64_t count, const char* what) {
      if (count > 0) job_.report.missing.push_back(fmt::format("{} of {} frames", what, count));
    };
    say(without_color_, "color image");
    say(without_depth_, "depth image");
    say(without_pose_, "pose");
    const auto span = frames_.empty() ? 0 : frames_.rbegin()->first - frames_.begin()->first + 1;
    say(span - frames_.size(), "all files");
  }

  ImportJob job_;
  SevenScenesOptions options_;
  CameraModel camera_;
  Eigen::Isometry3d T_camera_depth_ = Eigen::Isometry3d::Identity();
  std::map<unsigned, SceneFrame> frames_;
  std::uint64_t without_color_ = 0;
  std::uint64_t without_depth_ = 0;
  std::uint64_t without_pose_ = 0;
};

}  // namespace

storage::Result<ImportReport> import_seven_scenes(const fs::path& folder,
                                                  const SevenScenesOptions& options) {
  return guarded([&] {
    if (!fs::is_directory(folder)) fail_corrupt(folder, "is no folder");
    if (!(options.frame_rate_hz > 0.0)) {
      throw ImportError(storage::StatusCode::kInvalid, "the frame rate must be positive");
    }
    return SevenScenesImport(folder, options).run();
  });
}

}  // namespace camvox::import
