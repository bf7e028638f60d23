// Measures, in the same container as all else, how long after its inputs each frame's odometry
// leaves. Times are the publishers' own stamps: this component may be late without harm.
#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <vector>

#include "camvox/component/component.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"

namespace bench {

using camvox::Port;
using camvox_interfaces::msg::Scan;
namespace topics = camvox::topics;

struct LatencyConfig {
  std::string output_dir;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("output_dir", self.output_dir, camvox::config::not_empty());
  }
};

/// Writes latency.csv: when each image was published, when the last input that its frame needs
/// was, and when its odometry was, if it was. The inputs that a frame needs are its image, the
/// lidar message with the last point of its scan, and the IMU message with its last sample.
class LatencyComponent final : public camvox::Component {
 public:
  explicit LatencyComponent(camvox::Context& context)
      : config_(context.parameters<LatencyConfig>()) {
    note(context, {"image", topics::kCompressedImage}, "sensor_msgs/msg/CompressedImage", images_);
    note(context, {"lidar", topics::kLidar}, "livox_ros_driver2/msg/CustomMsg", lidar_);
    note(context, {"imu", topics::kImu}, "sensor_msgs/msg/Imu", imu_);
    note(context, {"odometry", topics::kOdometry}, "nav_msgs/msg/Odometry", odometry_);
    context.subscribe<Scan>(
        {"scan", topics::kScan},
        [this](const auto& scan) { needs_[scan->image_stamp_ns()] = end(*scan); },
        {.qos = camvox::qos::kKeyframes, .max_held = 0});
  }

  void stop() override {
    std::ofstream file(std::filesystem::path(config_.output_dir) / "latency.csv");
    file << "image_stamp_ns,image_in_ns,last_input_ns,odometry_ns\n";
    for (const auto& [stamp_ns, image_in_ns] : images_) {
      const auto needed = needs_.find(stamp_ns);
      const auto odometry = odometry_.find(stamp_ns);
      file << stamp_ns << ',' << image_in_ns << ','
           << (needed == needs_.end() ? 0 : last_input_ns(image_in_ns, needed->second)) << ','
           << (odometry == odometry_.end() ? 0 : odometry->second) << '\n';
    }
  }

 private:
  using Stamps = std::map<std::int64_t, std::int64_t>;  // of capture -> of publishing

  struct ScanEnd {
    std::int64_t points_ns = 0;
    std::int64_t imu_ns = 0;
  };

  /// Type-independent: all start with std_msgs/Header, little-endian.
  static void note(camvox::Context& context, const Port& port, const char* type, Stamps& stamps) {
    context.subscribe_raw(port,
                          type,
                          [&stamps](const auto& sample) {
                            std::int32_t sec = 0;
                            std::uint32_t nanosec = 0;
                            if (sample->cdr.size() < 12) return;
                            std::memcpy(&sec, sample->cdr.data() + 4, sizeof(sec));
                            std::memcpy(&nanosec, sample->cdr.data() + 8, sizeof(nanosec));
                            stamps[std::int64_t{sec} * 1'000'000'000 + nanosec] =
                                sample.info().publish_stamp_ns;
                          },
                          {.qos = {1024, true, false}});
  }

  static ScanEnd end(const Scan& scan) {
    ScanEnd end;
    const auto* offsets_ns = scan.point_offset_ns().data();
    if (const auto count = scan.points_count(); count > 0) {
      end.points_ns = scan.header().stamp_ns() + *std::max_element(offsets_ns, offsets_ns + count);
    }
    if (const auto count = scan.imu_stamp_ns_count(); count > 0) {
      end.imu_ns = scan.imu_stamp_ns()[count - 1];
    }
    return end;
  }

  /// When the newest message that starts at or before `stamp_ns` was published.
  static std::int64_t published_ns(const Stamps& stamps, std::int64_t stamp_ns) {
    const auto after = stamps.upper_bound(stamp_ns);
    return after == stamps.begin() ? 0 : std::prev(after)->second;
  }
  [[nodiscard]] std::int64_t last_input_ns(std::int64_t image_in_ns, const ScanEnd& end) const {
    return std::max(
        {image_in_ns, published_ns(lidar_, end.points_ns), published_ns(imu_, end.imu_ns)});
  }

  LatencyConfig config_;
  Stamps images_;
  Stamps lidar_;
  Stamps imu_;
  Stamps odometry_;
  std::map<std::int64_t, ScanEnd> needs_;  // by the image's stamp
};

}  // namespace bench

CAMVOX_REGISTER_COMPONENT(bench::LatencyComponent)
