#include "recording.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "camvox/interfaces/message_type.hpp"
#include "camvox/interfaces/nav_msgs.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/interfaces/tf2_msgs.hpp"
#include "camvox/storage/bag_reader.hpp"

namespace camvox::bench {
namespace {

using geometry::SE3;
using geometry::SO3;

constexpr double kNsToS = 1e-9;
constexpr float kPlainSigma_m = 0.03F;

template <typename Stamp>
std::int64_t to_ns(const Stamp& stamp) {
  return std::int64_t{1'000'000'000} * stamp.sec() + stamp.nanosec();
}

template <typename Translation, typename Rotation>
SE3 to_se3(const Translation& t, const Rotation& q) {
  return {SO3(Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z())), {t.x(), t.y(), t.z()}};
}

template <typename T>
T decode(const storage::BagMessage& message) {
  T decoded;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(message.data.data());
  if (!interfaces::message_type<T>().read_cdr(bytes, message.data.size(), &decoded)) {
    throw std::runtime_error("message that does not decode");
  }
  return decoded;
}

/// What the messages say before it is put together.
struct Parts {
  std::map<std::int64_t, RecordedFrame> frames;
  std::map<std::string, std::pair<std::string, SE3>> transforms;  ///< child: parent, T_parent_child
  std::string camera_frame;
  std::string lidar_frame;
  std::string body_frame;
  std::optional<sensors::CameraIntrinsics> intrinsics;
};

void read_camera_info(const sensor_msgs::msg::CameraInfo& info, Parts& parts) {
  if (parts.intrinsics) return;
  sensors::CameraIntrinsics intrinsics;
  intrinsics.width_px = static_cast<int>(info.width());
  intrinsics.height_px = static_cast<int>(info.height());
  intrinsics.fx_px = info.k()[0];
  intrinsics.cx_px = info.k()[2];
  intrinsics.fy_px = info.k()[4];
  intrinsics.cy_px = info.k()[5];
  if (!info.distortion_model().empty()) intrinsics.distortion_model = info.distortion_model();
  intrinsics.distortion = info.d();
  parts.intrinsics = intrinsics;
  parts.camera_frame = info.header().frame_id();
}

cv::Mat to_depth_image(const sensor_msgs::msg::Image& image) {
  cv::Mat depth(static_cast<int>(image.height()), static_cast<int>(image.width()), CV_16U);
  for (int v = 0; v < depth.rows; ++v) {
    std::memcpy(depth.ptr(v),
                image.data().data() + static_cast<std::size_t>(v) * image.step(),
                static_cast<std::size_t>(depth.cols) * 2);
  }
  return depth;
}

/// Velodyne: float32 x y z intensity time, the time in seconds after the stamp.
void read_sweep(const sensor_msgs::msg::PointCloud2& cloud, Parts& parts) {
  parts.lidar_frame = cloud.header().frame_id();
  const std::int64_t start_ns = to_ns(cloud.header().stamp());
  std::map<std::string, std::uint32_t> offsets;
  for (const auto& field : cloud.fields()) offsets[field.name()] = field.offset();
  // The image is taken while the scanner looks forward, in the middle of the sweep.
  const auto frame = parts.frames.lower_bound(start_ns);
  if (frame == parts.frames.end() || frame->first - start_ns > 110'000'000) return;
  Sweep sweep;
  const std::size_t count = cloud.width() * cloud.height();
  for (std::size_t i = 0; i < count; ++i) {
    const auto* point = cloud.data().data() + i * cloud.point_step();
    const auto value = [&](const char* name) {
      float number = 0.0F;
      std::memcpy(&number, point + offsets.at(name), sizeof(number));
      return number;
    };
    sweep.points_lidar.emplace_back(value("x"), value("y"), value("z"));
    sweep.after_image_s.push_back(
        value("time") - static_cast<float>(static_cast<double>(frame->first - start_ns) * kNsToS));
  }
  frame->second.sweep = std::move(sweep);
}

void read_message(const std::string& topic, const storage::BagMessage& message, Parts& parts) {
  if (topic == "/camera/image_raw/compressed") {
    auto image = decode<sensor_msgs::msg::CompressedImage>(message);
    auto& frame = parts.frames[to_ns(image.header().stamp())];
    frame.image_file.assign(image.data().begin(), image.data().end());
  } else if (topic == "/camera/camera_info") {
    read_camera_info(decode<sensor_msgs::msg::CameraInfo>(message), parts);
  } else if (topic == "/camera/depth_registered/image_raw") {
    const auto image = decode<sensor_msgs::msg::Image>(message);
    parts.frames[to_ns(image.header().stamp())].depth_mm = to_depth_image(image);
  } else if (topic == "/tf_static") {
    const auto tree = decode<tf2_msgs::msg::TFMessage>(message);
    for (const auto& transform : tree.transforms()) {
      parts.transforms[transform.child_frame_id()] = {
          transform.header().frame_id(),
          to_se3(transform.transform().translation(), transform.transform().rotation())};
    }
  }
}

void read_late_message(const std::string& topic, const storage::BagMessage& message, Parts& parts) {
  if (topic == "/velodyne_points") {
    read_sweep(decode<sensor_msgs::msg::PointCloud2>(message), parts);
  } else if (topic == "/ground_truth/odometry") {
    const auto odometry = decode<nav_msgs::msg::Odometry>(message);
    parts.body_frame = odometry.child_frame_id();
    const auto& pose = odometry.pose().pose();
    // OXTS has its own stamps, some milliseconds off the image's: the nearest frame counts.
    const std::int64_t stamp_ns = to_ns(odometry.header().stamp());
    auto frame = parts.frames.lower_bound(stamp_ns);
    const bool before = frame == parts.frames.end() ||
                        (frame != parts.frames.begin() &&
                         stamp_ns - std::prev(frame)->first < frame->first - stamp_ns);
    if (before) --frame;
    frame->second.T_truth_body = to_se3(pose.position(), pose.orientation());
  }
}

SE3 T_body(const Parts& parts, std::string frame) {
  SE3 T_frame_sensor;
  while (frame != parts.body_frame) {
    const auto found = parts.transforms.find(frame);
    if (found == parts.transforms.end()) return T_frame_sensor;
    T_frame_sensor = found->second.second * T_frame_sensor;
    frame = found->second.first;
  }
  return T_frame_sensor;
}

}  // namespace

Recording read_recording(const std::filesystem::path& bag) {
  const auto reader = storage::BagReader::open(bag);
  if (!reader.ok()) throw std::runtime_error(reader.status().message());
  Parts parts;
  for (const auto read : {read_message, read_late_message}) {
    auto cursor = (*reader)->messages();
    while (const auto* message = cursor.next()) {
      read((*reader)->topics()[message->topic].name, *message, parts);
    }
  }
  if (parts.frames.empty() || !parts.intrinsics) {
    throw std::runtime_error("no /camera/image_raw/compressed with /camera/camera_info");
  }
  Recording recording;
  recording.intrinsics = *parts.intrinsics;
  recording.T_body_camera = T_body(parts, parts.camera_frame);
  recording.T_body_lidar = T_body(parts, parts.lidar_frame);
  for (auto& [stamp_ns, frame] : parts.frames) {
    frame.stamp_ns = stamp_ns;
    recording.frames.push_back(std::move(frame));
  }
  return recording;
}

depth::DepthView DepthSource::depth_of(const RecordedFrame& frame,
                                       const geometry::Vector6d& twist_camera) {
  const auto& intrinsics = recording_.intrinsics;
  const auto pixels = static_cast<std::size_t>(intrinsics.width_px) *
                      static_cast<std::size_t>(intrinsics.height_px);
  depth_m_.assign(pixels, 0.0F);
  sigma_m_.assign(pixels, 0.0F);
  if (!frame.depth_mm.empty()) {
    from_depth_image(frame.depth_mm);
  } else if (frame.sweep) {
    from_sweep(*frame.sweep, twist_camera);
  } else {
    return {};
  }
  return {depth_m_.data(), sigma_m_.data(), intrinsics.width_px, intrinsics.height_px};
}

void DepthSource::from_depth_image(const cv::Mat& depth_mm) {
  const auto* pixel = depth_mm.ptr<std::uint16_t>();
  for (std::size_t i = 0; i < depth_m_.size(); ++i) {
    if (pixel[i] == 0 || pixel[i] == 65535) continue;
    const float z_m = 1e-3F * static_cast<float>(pixel[i]);
    depth_m_[i] = z_m;
    sigma_m_[i] = 0.0012F + 0.0019F * (z_m - 0.4F) * (z_m - 0.4F);
  }
}

void DepthSource::from_sweep(const Sweep& sweep, const geometry::Vector6d& twist_camera) {
  const SE3 T_camera_lidar = recording_.T_body_camera.inverse() * recording_.T_body_lidar;
  const geometry::Vector6d twist_lidar = T_camera_lidar.inverse().adjoint() * twist_camera;
  points_lidar_.clear();
  for (std::size_t i = 0; i < sweep.points_lidar.size(); ++i) {
    const SE3 T_image_then = SE3::exp(twist_lidar * static_cast<double>(sweep.after_image_s[i]));
    const Eigen::Vector3f p_lidar =
        (T_image_then * sweep.points_lidar[i].cast<double>()).cast<float>();
    points_lidar_.insert(points_lidar_.end(), {p_lidar.x(), p_lidar.y(), p_lidar.z(), 0.0F});
  }
  const depth::ScanView scan{points_lidar_, T_camera_lidar};
  if (plain_) {
    project_plainly(scan);
  } else {
    static_cast<void>(projector_.project({&scan, 1}, depth_m_, sigma_m_));
  }
}

void DepthSource::project_plainly(const depth::ScanView& scan) {
  const auto& camera = recording_.intrinsics;
  for (std::size_t i = 0; i < scan.points_lidar.size(); i += 4) {
    const Eigen::Vector3f p_lidar(&scan.points_lidar[i]);
    const Eigen::Vector3d p_camera = scan.T_camera_lidar * p_lidar.cast<double>();
    if (p_camera.z() < 0.5) continue;
    const long u = std::lround(camera.fx_px * p_camera.x() / p_camera.z() + camera.cx_px);
    const long v = std::lround(camera.fy_px * p_camera.y() / p_camera.z() + camera.cy_px);
    if (u < 0 || v < 0 || u >= camera.width_px || v >= camera.height_px) continue;
    const auto pixel = static_cast<std::size_t>(v * camera.width_px + u);
    const auto z_m = static_cast<float>(p_camera.z());
    if (depth_m_[pixel] > 0.0F && depth_m_[pixel] <= z_m) continue;
    depth_m_[pixel] = z_m;
    sigma_m_[pixel] = kPlainSigma_m;
  }
}

}  // namespace camvox::bench
