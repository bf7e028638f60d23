#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "camvox/component/fake_context.hpp"
#include "camvox/conversion/pose.hpp"
#include "camvox/deskew_component/deskew_component.hpp"
#include "camvox/import/kitti_raw.hpp"
#include "camvox/interfaces/header.hpp"
#include "camvox/interfaces/nav_msgs.hpp"
#include "camvox/interfaces/tf2_msgs.hpp"
#include "camvox/storage/bag_reader.hpp"
#include "camvox/sync_component/sync_component.hpp"

// A real drive through sync and deskew, with the recording's own trajectory up to the frame before
// as odometry: each return must come to lie where the trajectory, in hindsight, puts it.
namespace camvox {
namespace {

namespace fs = std::filesystem;
namespace msg = camvox_interfaces::msg;
using geometry::SE3;
using geometry::SO3;

constexpr std::size_t kFrames = 14;
constexpr std::size_t kImages = 16;

template <typename Translation, typename Rotation>
SE3 to_se3(const Translation& t, const Rotation& q) {
  return {SO3(Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z())), {t.x(), t.y(), t.z()}};
}

void set_transform(FakeContext& fake, const std::string& key, const SE3& T) {
  const auto& t = T.translation();
  const auto& q = T.rotation().quaternion();
  fake.set_parameter(key + ".translation_m", std::vector<double>{t.x(), t.y(), t.z()});
  fake.set_parameter(key + ".rotation_xyzw", std::vector<double>{q.x(), q.y(), q.z(), q.w()});
}

class KittiDrive : public ::testing::Test {
 protected:
  static inline const fs::path kData = fs::path(SHARED_DATA) / "kitti_0013";

  void SetUp() override {
    if (!fs::exists(kData)) GTEST_SKIP() << "no recording at " << kData;
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    import::KittiRawOptions options;
    options.output = folder_ / "bag";
    const auto imported = import::import_kitti_raw(kData, options);
    ASSERT_TRUE(imported.ok()) << imported.status().message();
    auto reader = storage::BagReader::open(options.output);
    ASSERT_TRUE(reader.ok());
    reader_ = *std::move(reader);
    read_truth();
    configure();
  }
  void TearDown() override { fs::remove_all(folder_); }

  template <typename T, typename Logged>
  [[nodiscard]] static T read(const Logged& logged) {
    T message;
    EXPECT_TRUE(interfaces::message_type<T>().read_cdr(
        reinterpret_cast<const std::uint8_t*>(logged.data.data()), logged.data.size(), &message));
    return message;
  }

  void read_truth() {
    auto cursor = reader_->messages();
    while (const auto* logged = cursor.next()) {
      const auto& topic = reader_->topics()[logged->topic].name;
      if (topic == "/ground_truth/odometry") {
        const auto odometry = read<nav_msgs::msg::Odometry>(*logged);
        const auto& pose = odometry.pose().pose();
        truth_.push_back(
            {interfaces::stamp_of(odometry.header()), to_se3(pose.position(), pose.orientation())});
      } else if (topic == topics::kStaticTransforms) {
        for (const auto& given : read<tf2_msgs::msg::TFMessage>(*logged).transforms()) {
          const auto T = to_se3(given.transform().translation(), given.transform().rotation());
          if (given.child_frame_id() == "velodyne") T_imu_lidar_ = T;
          if (given.child_frame_id() == "camera_optical_frame") T_lidar_camera_ = T;
        }
      } else if (topic == topics::kCameraInfo) {
        camera_ = read<sensor_msgs::msg::CameraInfo>(*logged);
      }
    }
  }

  void configure() {
    sync_fake_.set_parameter("depth_source", std::string("point_cloud"));
    sync_fake_.set_parameter("scan_window", std::string("centred"));
    sync_fake_.set_parameter("lockstep", true);
    sync_fake_.set_parameter("camera.width_px", std::int64_t{camera_.width()});
    sync_fake_.set_parameter("camera.height_px", std::int64_t{camera_.height()});
    set_transform(deskew_fake_, "rig.T_imu_lidar", T_imu_lidar_);
    set_transform(deskew_fake_, "rig.T_lidar_camera", T_lidar_camera_);
  }

  /// The IMU's true pose; between fixes, and the IMU is the base link.
  [[nodiscard]] SE3 T_map_imu(std::int64_t stamp_ns) const {
    const auto after =
        std::ranges::lower_bound(truth_, stamp_ns, {}, [](const auto& t) { return t.first; });
    if (after == truth_.begin() || after == truth_.end()) return truth_.front().second;
    const auto& before = *std::prev(after);
    return geometry::interpolate(before.second,
                                 after->second,
                                 static_cast<double>(stamp_ns - before.first) /
                                     static_cast<double>(after->first - before.first));
  }

  void play(SyncComponent&) {
    auto cursor = reader_->messages();
    std::size_t images = 0;
    while (const auto* logged = cursor.next()) {
      const auto& topic = reader_->topics()[logged->topic].name;
      if (topic == topics::kCompressedImage) {
        if (++images > kImages) return;
        sync_fake_.send("compressed_image", read<sensor_msgs::msg::CompressedImage>(*logged));
      } else if (topic == "/velodyne_points") {
        sync_fake_.send("lidar", read<sensor_msgs::msg::PointCloud2>(*logged));
      } else if (topic == "/imu/data") {
        sync_fake_.send("imu", read<sensor_msgs::msg::Imu>(*logged));
      }
    }
  }

  void send_pose(const msg::Scan& scan) {
    msg::FramePose pose;
    pose.header().stamp_ns(scan.image_stamp_ns());
    pose.header().frame_id(scan.header().frame_id());
    pose.state(msg::TRACKING_OK);
    pose.T_map_camera(
        conversion::to_array(T_map_imu(scan.image_stamp_ns()) * T_imu_lidar_ * T_lidar_camera_));
    pose.T_keyframe_camera(pose.T_map_camera());
    deskew_fake_.send("frame_pose", pose);
  }

  fs::path folder_ = fs::temp_directory_path() / ("camvox_deskew_" + std::to_string(getpid()));
  std::unique_ptr<storage::BagReader> reader_;
  std::vector<std::pair<std::int64_t, SE3>> truth_;
  SE3 T_imu_lidar_, T_lidar_camera_;
  sensor_msgs::msg::CameraInfo camera_;
  FakeContext sync_fake_{"sync"}, deskew_fake_{"deskew"};
};

/// Root mean square distance of returns to where the true motion puts them.
template <typename Message>
double error_m(const msg::Scan& scan, const Message& moved, const std::vector<SE3>& T_image_lidar) {
  double sum_m2 = 0.0;
  const auto point = [](const auto& row) {
    return Eigen::Vector3d(
        static_cast<double>(row[0]), static_cast<double>(row[1]), static_cast<double>(row[2]));
  };
  for (std::size_t i = 0; i < scan.points_count(); ++i) {
    sum_m2 += (point(moved.points()[i]) - T_image_lidar[i] * point(scan.points()[i])).squaredNorm();
  }
  return std::sqrt(sum_m2 / scan.points_count());
}

TEST_F(KittiDrive, PutsReturnsWhereTheTrueMotionDoes) {
  SyncComponent sync(sync_fake_);
  DeskewComponent deskew(deskew_fake_);
  play(sync);
  const auto scans = sync_fake_.published<msg::Scan>("scan");
  ASSERT_GE(scans.size(), kFrames);
  for (const auto& scan : scans) {
    deskew_fake_.send("scan", *scan);
    send_pose(*scan);
  }
  const auto clouds = deskew_fake_.published<msg::Cloud>("cloud");
  ASSERT_EQ(clouds.size(), scans.size());
  double deskewed_m = 0.0, raw_m = 0.0;
  for (std::size_t i = kFrames - 4; i < kFrames; ++i) {
    EXPECT_EQ(clouds[i]->deskew(), msg::DESKEW_GYRO_AND_VELOCITY);
    const SE3 T_image_map = (T_map_imu(scans[i]->image_stamp_ns()) * T_imu_lidar_).inverse();
    std::vector<SE3> T_image_lidar;
    for (std::size_t p = 0; p < scans[i]->points_count(); ++p) {
      const auto time_ns = scans[i]->header().stamp_ns() + scans[i]->point_offset_ns()[p];
      T_image_lidar.push_back(T_image_map * T_map_imu(time_ns) * T_imu_lidar_);
    }
    deskewed_m = std::max(deskewed_m, error_m(*scans[i], *clouds[i], T_image_lidar));
    raw_m = std::max(raw_m, error_m(*scans[i], *scans[i], T_image_lidar));
  }
  RecordProperty("deskewed_mm", std::to_string(1e3 * deskewed_m));
  RecordProperty("raw_mm", std::to_string(1e3 * raw_m));
  // The IMU has 10 Hz here, and the fixes are 2 cm apart from a smooth motion.
  EXPECT_LT(deskewed_m, 0.02);
  EXPECT_GT(raw_m, 5.0 * deskewed_m);
}

}  // namespace
}  // namespace camvox
