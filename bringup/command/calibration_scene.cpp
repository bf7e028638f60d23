#include "calibration_scene.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string_view>

#include "bag_message.hpp"
#include "camvox/interfaces/livox_ros_driver2.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/storage/bag_reader.hpp"
#include "camvox/sync/image_decoder.hpp"
#include "camvox/sync_component/lidar_input.hpp"
#include "command.hpp"

namespace camvox::command {
namespace {

using sensor_msgs::msg::CompressedImage;
using sensor_msgs::msg::Image;
using sensor_msgs::msg::PointCloud2;

constexpr std::size_t kMaxPoints = 5'000'000;
constexpr std::string_view kCompressed = "sensor_msgs/msg/CompressedImage";
constexpr std::string_view kImage = "sensor_msgs/msg/Image";
constexpr std::string_view kLivox = "livox_ros_driver2/msg/CustomMsg";
constexpr std::string_view kCloud = "sensor_msgs/msg/PointCloud2";

/// The topic of that name, or the first of the first type that there is.
const storage::BagTopic& choose(const storage::BagReader& bag,
                                const std::string& name,
                                const std::array<std::string_view, 2>& types,
                                const char* what) {
  for (const auto type : types) {
    for (const auto& topic : bag.topics()) {
      if (topic.type == type && (name.empty() || topic.name == name)) return topic;
    }
  }
  throw CommandError(name.empty() ? fmt::format("the bag has no topic with {}", what)
                                  : fmt::format("the bag has no topic {} with {}", name, what));
}

cv::Mat read_image(const storage::BagMessage& raw,
                   const storage::BagTopic& topic,
                   const sensors::CameraIntrinsics& camera) {
  cv::Mat image(camera.height_px, camera.width_px, CV_8UC3);
  const sync::ImageTarget target{
      {image.data, image.total() * 3}, image.cols, image.rows, sync::PixelFormat::kBgr8};
  sync::ImageDecoder decoder;
  std::string problem;
  if (topic.type == kCompressed) {
    problem = decoder.decode(decode<CompressedImage>(raw, topic.name).data(), target);
  } else {
    const auto message = decode<Image>(raw, topic.name);
    problem = decoder.convert({message.encoding(),
                               static_cast<int>(message.width()),
                               static_cast<int>(message.height()),
                               message.step(),
                               message.data()},
                              target);
  }
  if (!problem.empty()) throw CommandError(fmt::format("{}: the image {}", topic.name, problem));
  return image;
}

void append_scan(const storage::BagMessage& raw,
                 const storage::BagTopic& topic,
                 std::vector<Eigen::Vector4f>& points_lidar) {
  sync::LidarChunk chunk;
  const auto problem =
      topic.type == kLivox
          ? sync_component::read_livox(
                decode<livox_ros_driver2::msg::CustomMsg>(raw, topic.name), {}, chunk)
          : sync_component::read_point_cloud(decode<PointCloud2>(raw, topic.name), {}, chunk);
  if (!problem.empty()) throw CommandError(fmt::format("{}: a scan {}", topic.name, problem));
  for (const auto& point : chunk.returns) {
    if (points_lidar.size() >= kMaxPoints) return;
    points_lidar.emplace_back(point.x_m, point.y_m, point.z_m, point.reflectivity);
  }
}

}  // namespace

calibration::Scene read_scene(const SceneOptions& options,
                              const sensors::CameraIntrinsics& camera) {
  auto opened = storage::BagReader::open(options.bag);
  if (!opened.ok()) throw CommandError(opened.status().message());
  const auto bag = *std::move(opened);
  const auto& images = choose(*bag, options.image_topic, {kCompressed, kImage}, "images");
  const auto& scans = choose(*bag, options.lidar_topic, {kLivox, kCloud}, "lidar points");
  storage::MessageFilter filter;
  filter.topics = {images.name, scans.name};
  filter.start_time_ns =
      static_cast<std::uint64_t>(bag->start_time_ns() + std::llround(1e9 * options.start_s));
  filter.end_time_ns =
      filter.start_time_ns + static_cast<std::uint64_t>(std::llround(1e9 * options.duration_s));
  calibration::Scene scene;
  auto cursor = bag->messages(filter);
  while (const auto* raw = cursor.next()) {
    const auto& topic = bag->topics()[raw->topic];
    if (topic.name == scans.name) {
      append_scan(*raw, topic, scene.points_lidar);
    } else if (scene.image.empty()) {
      scene.image = read_image(*raw, topic, camera);
    }
  }
  if (!cursor.status().ok()) throw CommandError(cursor.status().message());
  if (scene.image.empty()) throw CommandError(images.name + ": no image in the part to use");
  return scene;
}

}  // namespace camvox::command
