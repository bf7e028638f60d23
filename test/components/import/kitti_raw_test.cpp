#include "camvox/import/kitti_raw.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <numbers>
#include <sstream>
#include <unordered_map>

#include "camvox/interfaces/nav_msgs.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/interfaces/tf2_msgs.hpp"
#include "imported_bag.hpp"

// The importer on the real drive, against the raw files read here by other means.
namespace camvox::import {
namespace {

using sensor_msgs::msg::PointCloud2;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

constexpr std::int64_t kSecond_ns = 1'000'000'000;
// 2011-09-26 13:10:51 UTC, from date(1).
constexpr std::int64_t kBegin_ns = 1317042651 * kSecond_ns;
const fs::path kDate = fs::path(SHARED_DATA) / "kitti_0013";
const fs::path kDrive = kDate / "2011_09_26_drive_0013_sync";

/// One import for all tests of this file.
class KittiRaw : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!fs::exists(kDrive)) return;
    folder_ = fs::temp_directory_path() / ("camvox_kitti_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    KittiRawOptions options;
    options.output = folder_ / "bag";
    options.progress = [](const ImportProgress& progress) {
      EXPECT_LE(progress.done, progress.total);
      return true;
    };
    auto result = import_kitti_raw(kDate, options);
    ASSERT_TRUE(result.ok()) << result.status().message();
    report_ = *std::move(result);
    bag_ = std::make_unique<ImportedBag>(folder_ / "bag");
  }
  static void TearDownTestSuite() {
    bag_.reset();
    fs::remove_all(folder_);
  }
  void SetUp() override {
    if (!fs::exists(kDrive)) GTEST_SKIP() << "no recording at " << kDrive;
    ASSERT_NE(bag_, nullptr);
  }

  static inline fs::path folder_;
  static inline ImportReport report_;
  static inline std::unique_ptr<ImportedBag> bag_;
};

std::vector<float> raw_points(int frame) {
  char name[32];
  std::snprintf(name, sizeof(name), "%010d.bin", frame);
  std::ifstream stream(kDrive / "velodyne_points" / "data" / name, std::ios::binary);
  std::stringstream bytes;
  bytes << stream.rdbuf();
  std::vector<float> values(bytes.str().size() / sizeof(float));
  std::memcpy(values.data(), bytes.str().data(), values.size() * sizeof(float));
  return values;
}

/// x, y, z, intensity, time of each point of a message.
std::vector<std::array<float, 5>> points_of(const PointCloud2& cloud) {
  std::vector<std::array<float, 5>> points(cloud.width());
  EXPECT_EQ(cloud.data().size(), points.size() * 20);
  std::memcpy(points.data(), cloud.data().data(), points.size() * 20);
  return points;
}

Eigen::Isometry3d pose_of(const nav_msgs::msg::Odometry& odometry) {
  const auto& pose = odometry.pose().pose();
  Eigen::Isometry3d T(Eigen::Quaterniond(pose.orientation().w(),
                                         pose.orientation().x(),
                                         pose.orientation().y(),
                                         pose.orientation().z()));
  T.pretranslate(Eigen::Vector3d(pose.position().x(), pose.position().y(), pose.position().z()));
  return T;
}

TEST_F(KittiRaw, HasAllMessagesAndSaysSo) {
  EXPECT_THAT(bag_->counts(),
              ElementsAre(Pair("/camera/camera_info", 144),
                          Pair("/camera/image_raw/compressed", 144),
                          Pair("/gnss/fix", 144),
                          Pair("/ground_truth/odometry", 144),
                          Pair("/imu/data", 144),
                          Pair("/tf_static", 1),
                          Pair("/velodyne_points", 144)));
  EXPECT_TRUE(report_.missing.empty());
  EXPECT_TRUE(report_.left_out.empty());
  EXPECT_EQ(report_.topics.size(), 7U);
  EXPECT_EQ(report_.bag, folder_ / "bag");
}

TEST_F(KittiRaw, ImagesAreTheFiles) {
  const auto images =
      bag_->messages<sensor_msgs::msg::CompressedImage>("/camera/image_raw/compressed");
  EXPECT_EQ(stamp_ns(images[0].message), kBegin_ns + 168593664);
  EXPECT_EQ(stamp_ns(images[1].message), kBegin_ns + 272099072);
  EXPECT_EQ(images[0].message.format(), "jpeg");
  std::ifstream stream(kDrive / "image_02/data/0000000143.jpg", std::ios::binary);
  const std::vector<std::uint8_t> file{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_EQ(images[143].message.data(), file);
  const auto infos = bag_->messages<sensor_msgs::msg::CameraInfo>("/camera/camera_info");
  const auto& info = infos[0].message;
  EXPECT_EQ(stamp_ns(info), stamp_ns(images[0].message));
  EXPECT_EQ(info.width(), 1242U);
  EXPECT_EQ(info.height(), 375U);
  EXPECT_THAT(info.k(), ElementsAre(721.5377, 0, 609.5593, 0, 721.5377, 172.854, 0, 0, 1));
  EXPECT_THAT(info.d(), ElementsAre(0, 0, 0, 0, 0));
}

TEST_F(KittiRaw, CloudsAreTheFilesStampedAtTheSweepsStart) {
  const auto clouds = bag_->messages<PointCloud2>("/velodyne_points");
  EXPECT_EQ(stamp_ns(clouds[0].message), kBegin_ns + 106324297);
  EXPECT_EQ(clouds[0].log_time_ns, kBegin_ns + 209814938);
  for (const int frame : {0, 70, 143}) {
    const auto raw = raw_points(frame);
    const auto points = points_of(clouds[static_cast<std::size_t>(frame)].message);
    ASSERT_EQ(points.size() * 4, raw.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_EQ(std::memcmp(points[i].data(), &raw[4 * i], 16), 0) << frame << ' ' << i;
    }
  }
}

// Time falls as the azimuth rises, from 0 behind on the left to the end behind on the right; a
// point straight ahead has the time of the trigger.
TEST_F(KittiRaw, PointTimesFollowTheAzimuth) {
  const auto clouds = bag_->messages<PointCloud2>("/velodyne_points");
  auto points = points_of(clouds[20].message);
  std::ranges::sort(points, {}, [](const auto& p) { return -std::atan2(p[1], p[0]); });
  for (std::size_t i = 1; i < points.size(); ++i) ASSERT_GE(points[i][4], points[i - 1][4]);
  const auto ahead =
      std::ranges::min(points, {}, [](const auto& p) { return std::abs(p[1] / p[0]); });
  EXPECT_NEAR(ahead[4], 0.1035 / 2, 1e-4);  // a sweep takes 103.5 ms
  EXPECT_GE(points.front()[4], 0.0F);
  EXPECT_LT(points.back()[4], 0.1035F);
}

TEST_F(KittiRaw, ImuAndFixAreTheOxtsColumns) {
  const auto imus = bag_->messages<sensor_msgs::msg::Imu>("/imu/data");
  const auto fixes = bag_->messages<sensor_msgs::msg::NavSatFix>("/gnss/fix");
  EXPECT_EQ(stamp_ns(imus[0].message), kBegin_ns + 175862102);
  const auto& imu = imus[0].message;
  EXPECT_DOUBLE_EQ(imu.linear_acceleration().x(), -0.43999459306673);
  EXPECT_DOUBLE_EQ(imu.linear_acceleration().z(), 9.663174859472);
  EXPECT_DOUBLE_EQ(imu.angular_velocity().x(), -0.0022083457830958);
  EXPECT_DOUBLE_EQ(imu.angular_velocity().z(), 0.0062110895146255);
  EXPECT_NEAR(2.0 * std::atan2(imu.orientation().z(), imu.orientation().w()), 1.8456953, 1e-4);
  EXPECT_DOUBLE_EQ(fixes[0].message.latitude(), 49.013141872681);
  EXPECT_DOUBLE_EQ(fixes[0].message.longitude(), 8.4378138518088);
  EXPECT_DOUBLE_EQ(fixes[0].message.altitude(), 114.06644439697);
  EXPECT_EQ(fixes[0].message.status().status(), 2);
  EXPECT_NEAR(
      fixes[0].message.position_covariance()[4], 0.14961617559609 * 0.14961617559609, 1e-12);
}

TEST_F(KittiRaw, GroundTruthIs173MetresLong) {
  const auto truth = bag_->messages<nav_msgs::msg::Odometry>("/ground_truth/odometry");
  EXPECT_TRUE(pose_of(truth[0].message).translation().isZero(1e-9));
  double length_m = 0.0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const auto step = pose_of(truth[i - 1].message).inverse() * pose_of(truth[i].message);
    length_m += step.translation().norm();
    // The pose moves as the velocity of the body says: the right axes, and the right way round.
    const auto& v = truth[i].message.twist().twist().linear();
    const double dt_s =
        1e-9 * static_cast<double>(stamp_ns(truth[i].message) - stamp_ns(truth[i - 1].message));
    // OXTS stamps are up to 10 ms off the frames: 12 m/s * 10 ms, at 1.2 m a step.
    EXPECT_LT((step.translation() - dt_s * Eigen::Vector3d(v.x(), v.y(), v.z())).norm(), 0.25) << i;
  }
  EXPECT_NEAR(length_m, 173.0, 1.0);
}

// Projects the chain /tf_static + CameraInfo and the calibration's own formula (IJRR, eq. 7 and 8).
TEST_F(KittiRaw, StaticTransformsProjectAsTheCalibrationDoes) {
  const auto tree = bag_->messages<tf2_msgs::msg::TFMessage>("/tf_static");
  const auto& transforms = tree[0].message.transforms();
  ASSERT_EQ(transforms.size(), 3U);
  EXPECT_EQ(transforms[2].header().frame_id(), "velodyne");
  EXPECT_EQ(transforms[2].child_frame_id(), "camera_optical_frame");
  const auto& t = transforms[2].transform();
  Eigen::Isometry3d T_lidar_camera(
      Eigen::Quaterniond(t.rotation().w(), t.rotation().x(), t.rotation().y(), t.rotation().z()));
  T_lidar_camera.pretranslate(
      Eigen::Vector3d(t.translation().x(), t.translation().y(), t.translation().z()));

  Eigen::Matrix4d velo_to_cam, rectify;
  velo_to_cam << 7.533745e-03, -9.999714e-01, -6.166020e-04, -4.069766e-03, 1.480249e-02,
      7.280733e-04, -9.998902e-01, -7.631618e-02, 9.998621e-01, 7.523790e-03, 1.480755e-02,
      -2.717806e-01, 0, 0, 0, 1;
  rectify << 9.999239e-01, 9.837760e-03, -7.445048e-03, 0, -9.869795e-03, 9.999421e-01,
      -4.278459e-03, 0, 7.402527e-03, 4.351614e-03, 9.999631e-01, 0, 0, 0, 0, 1;
  Eigen::Matrix<double, 3, 4> projection;
  projection << 7.215377e+02, 0, 6.095593e+02, 4.485728e+01, 0, 7.215377e+02, 1.728540e+02,
      2.163791e-01, 0, 0, 1, 2.745884e-03;
  for (const Eigen::Vector3d& p_lidar :
       {Eigen::Vector3d(10, 2, -1), Eigen::Vector3d(40, -15, 1), Eigen::Vector3d(5, 0, 0)}) {
    const Eigen::Vector3d expected = projection * rectify * velo_to_cam * p_lidar.homogeneous();
    const Eigen::Vector3d p_camera = T_lidar_camera.inverse() * p_lidar;
    // The calibration has seven digits; the rotations are made exact: some 1e-6 of 720 px.
    EXPECT_NEAR(
        721.5377 * p_camera.x() / p_camera.z() + 609.5593, expected.x() / expected.z(), 0.01);
    EXPECT_NEAR(
        721.5377 * p_camera.y() / p_camera.z() + 172.854, expected.y() / expected.z(), 0.01);
  }
}

/// Points of a sweep in the map, moved to where they were at their time; `sense` -1 turns the
/// scanner the other way. `beside`: only those that are near, not ahead, and not of the road, where
/// the times differ most from that of the trigger.
std::vector<Eigen::Vector3d> in_map(const PointCloud2& cloud,
                                    const nav_msgs::msg::Odometry& odometry,
                                    const Eigen::Isometry3d& T_base_lidar,
                                    double sense,
                                    bool beside) {
  const auto& v = odometry.twist().twist().linear();
  const auto& w = odometry.twist().twist().angular();
  const double lead_s = 1e-9 * static_cast<double>(stamp_ns(cloud) - stamp_ns(odometry));
  constexpr double kForward_s = 0.1035 / 2;
  std::vector<Eigen::Vector3d> points;
  for (const auto& point : points_of(cloud)) {
    const double dt_s = lead_s + kForward_s + sense * (point[4] - kForward_s);
    Eigen::Vector3d turn = dt_s * Eigen::Vector3d(w.x(), w.y(), w.z());
    Eigen::Isometry3d T(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
    T.pretranslate(dt_s * Eigen::Vector3d(v.x(), v.y(), v.z()));
    const bool skipped =
        std::abs(std::atan2(point[1], point[0])) < 0.5F || point[0] > 20.0F || point[2] < -1.2F;
    if (beside && skipped) continue;
    points.push_back(pose_of(odometry) * T * T_base_lidar *
                     Eigen::Vector3d(point[0], point[1], point[2]));
  }
  return points;
}

/// Mean distance to the nearest point of another cloud, at most 0.2 m.
double mean_gap_m(const std::vector<Eigen::Vector3d>& from,
                  const std::vector<Eigen::Vector3d>& to) {
  constexpr double kCell_m = 0.2;
  const auto key = [](const Eigen::Vector3d& p, int dx, int dy, int dz) {
    const auto cell = [](double value, int d) {
      return static_cast<long>(std::floor(value / kCell_m)) + d;
    };
    return (cell(p.x(), dx) * 73856093L) ^ (cell(p.y(), dy) * 19349663L) ^
           (cell(p.z(), dz) * 83492791L);
  };
  std::unordered_map<long, std::vector<Eigen::Vector3d>> cells;
  for (const auto& p : to) cells[key(p, 0, 0, 0)].push_back(p);
  double sum_m = 0.0;
  for (const auto& p : from) {
    double gap_m = kCell_m;
    for (int i = 0; i < 27; ++i) {
      const auto found = cells.find(key(p, i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
      if (found == cells.end()) continue;
      for (const auto& q : found->second) gap_m = std::min(gap_m, (p - q).norm());
    }
    sum_m += gap_m;
  }
  return sum_m / static_cast<double>(from.size());
}

// The sense of the scanner's turn, from the data: sweeps 0.6 s apart agree best
// when each point is put to its time, worse without, and worst with the opposite turn.
TEST_F(KittiRaw, PointTimesMakeSweepsAgree) {
  const auto clouds = bag_->messages<PointCloud2>("/velodyne_points");
  const auto truth = bag_->messages<nav_msgs::msg::Odometry>("/ground_truth/odometry");
  Eigen::Isometry3d T_lidar_imu = Eigen::Isometry3d::Identity();  // calib_imu_to_velo.txt, rounded
  T_lidar_imu.linear() = Eigen::AngleAxisd(0.0148245, Eigen::Vector3d::UnitX()).matrix();
  T_lidar_imu.translation() << -0.8087, 0.3196, -0.7997;
  double gap_m[3] = {0, 0, 0};
  for (std::size_t i = 0; i + 6 < clouds.size(); i += 4) {
    for (int way = 0; way < 3; ++way) {
      const auto cloud = [&](std::size_t frame, bool beside) {
        return in_map(
            clouds[frame].message, truth[frame].message, T_lidar_imu.inverse(), 1 - way, beside);
      };
      gap_m[way] += mean_gap_m(cloud(i + 6, true), cloud(i, false));
    }
  }
  EXPECT_LT(gap_m[0], gap_m[1]);
  EXPECT_LT(gap_m[1], gap_m[2]);
  // The gap over the rate of the turn is a parabola; its lowest point is at the true rate, +1. The
  // cone of 100 degrees says little (the gaps differ by 7 %), so 0.3 is as sharp as it gets.
  const double bend_m = gap_m[0] - 2.0 * gap_m[1] + gap_m[2];
  EXPECT_NEAR((gap_m[2] - gap_m[0]) / (2.0 * bend_m), 1.0, 0.3);
}

}  // namespace
}  // namespace camvox::import
