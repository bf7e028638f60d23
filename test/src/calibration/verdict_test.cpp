#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "camvox/calibration/calibrator.hpp"
#include "real_pairs.hpp"
#include "simulated_stop.hpp"

// Whether a calibration knows how good it is. Truth is the synthetic world's rig, or the reference
// of a data set.
namespace camvox::calibration {
namespace {

using geometry::SE3;
using geometry::Vector6d;

constexpr double kDegree = std::numbers::pi / 180.0;

SE3 off(const SE3& T_camera_lidar) {
  return geometry::retract(T_camera_lidar,
                           (Vector6d() << 0.02, -0.015, 0.02, 0.03, -0.02, 0.04).finished());
}

/// Squared error over its covariance, per dimension.
double normalised(const CalibrationResult& result, const SE3& truth) {
  const Vector6d error = geometry::local(truth, result.T_camera_lidar);
  return error.dot(result.covariance_lidar.ldlt().solve(error)) / 6.0;
}

TEST(Verdict, CovarianceTellsTheError) {
  // Places that constrain the extrinsics in different ways; none of them was chosen by its error.
  const std::vector<test::Stop> stops = {
      {"corridor", 1, 6, 0, 0.0}, {"campus", 2, 20, -1.2, 0.0}, {"street", 1, 10, -1.2, 0.0}};
  const SE3 truth = test::true_T_camera_lidar();
  double sum = 0.0;
  for (const auto& stop : stops) {
    const auto result = calibrate({test::look_from(stop, 1)}, {}, off(truth));
    ASSERT_EQ(result.status, CalibrationStatus::kDone);
    EXPECT_TRUE(result.accepted) << stop.world << ": " << result.reason;
    sum += normalised(result, truth);
  }
  const double error = std::sqrt(sum / static_cast<double>(stops.size()));
  // 18 dimensions: a right covariance gives 1 +- 0.17; scenes and errors differ more than that.
  EXPECT_GT(error, 0.5);
  EXPECT_LT(error, 2.0);
}

TEST(Verdict, ASparseScanIsKnownLessWell) {
  const std::filesystem::path pairs = std::filesystem::path(SHARED_DATA) / "lidar_camera_pairs";
  if (!std::filesystem::exists(pairs)) GTEST_SKIP() << pairs << " is absent";
  const auto pair = test::junction(pairs, 'a');
  const auto result = calibrate({pair.scene}, pair.intrinsics, off(pair.T_camera_lidar));
  ASSERT_EQ(result.status, CalibrationStatus::kDone);
  const Vector6d error = geometry::local(pair.T_camera_lidar, result.T_camera_lidar);
  EXPECT_LT(error.head<3>().norm() / kDegree, 0.3);  // what the issue asks for
  EXPECT_GT(result.sigma_rotation_deg, 0.1);         // a spinning lidar's one turn
  EXPECT_LT(std::sqrt(normalised(result, pair.T_camera_lidar)), 2.0);
  EXPECT_GT(result.fit, result.rival_fit);
}

TEST(Verdict, SeveralSparseScansAreKnownWell) {
  const std::filesystem::path kitti = std::filesystem::path(SHARED_DATA) / "kitti_0013";
  if (!std::filesystem::exists(kitti)) GTEST_SKIP() << kitti << " is absent";
  std::vector<Scene> scenes;
  test::RealPair pair;
  for (int k = 0; k < 10; ++k) {
    pair = test::kitti_frame(kitti, "2011_09_26_drive_0013_sync", 5 + 14 * k);
    scenes.push_back(std::move(pair.scene));
  }
  const auto result = calibrate(scenes, pair.intrinsics, off(pair.T_camera_lidar));
  ASSERT_EQ(result.status, CalibrationStatus::kDone);
  EXPECT_TRUE(result.accepted) << result.reason;
  const Vector6d error = geometry::local(pair.T_camera_lidar, result.T_camera_lidar);
  EXPECT_LT(error.head<3>().norm() / kDegree, 0.2);  // 0.4 without outlines and widening
  EXPECT_LT(std::sqrt(normalised(result, pair.T_camera_lidar)), 2.0);
  // The beam of an HDL-64E widens to 2 mrad: what it grazes looks wider by half of that or more.
  EXPECT_GT(result.widening_rad.x(), 0.5e-3);
  EXPECT_LT(result.widening_rad.x(), 3e-3);
}

}  // namespace
}  // namespace camvox::calibration
