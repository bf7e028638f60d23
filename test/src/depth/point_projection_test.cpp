#include "point_projection.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace camvox::depth {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr float kMargin_px = 16.0F;
/// What the header promises.
constexpr double kAgreement_px = 0.01;

/// 640 x 480 pixels whose corners look this far off the axis, evenly in the angle.
sensors::CameraIntrinsics fisheye(double half_diagonal_deg) {
  sensors::CameraIntrinsics camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 400.0 / (half_diagonal_deg * kDegree);
  camera.cx_px = 319.5;
  camera.cy_px = 239.5;
  camera.distortion_model = "equidistant";
  camera.distortion = {};
  return camera;
}

/// 5 m away, `angle` off the axis, and around it.
std::array<float, 4> return_at(double angle_deg, double around_deg) {
  const double sine = std::sin(angle_deg * kDegree);
  return {static_cast<float>(5.0 * sine * std::cos(around_deg * kDegree)),
          static_cast<float>(5.0 * sine * std::sin(around_deg * kDegree)),
          static_cast<float>(5.0 * std::cos(angle_deg * kDegree)),
          0.0F};
}

struct Agreement {
  double worst_px = 0.0;
  int kept = 0;
  int lost = 0;     ///< In the picture by CameraModel, and not kept.
  int made_up = 0;  ///< The other way round.
};

/// Directions up to `end_deg` off the axis; those within a pixel of the border may fall either way.
Agreement compare(const sensors::CameraIntrinsics& intrinsics, double end_deg) {
  const sensors::CameraModel camera(intrinsics);
  const PointProjection projection(camera, {.margin_px = kMargin_px});
  Agreement result;
  for (double angle_deg = 0.05; angle_deg < end_deg; angle_deg += 0.2) {
    for (double around_deg = 0.0; around_deg < 360.0; around_deg += 3.1) {
      const auto point = return_at(angle_deg, around_deg);
      ProjectedPoints points;
      projection.append(point, geometry::SE3(), points);
      const auto u_px = camera.project({point[0], point[1], point[2]});
      if (points.size() == 0) {
        result.lost += u_px && camera.contains(*u_px, 1.0 - kMargin_px) ? 1 : 0;
        continue;
      }
      ++result.kept;
      result.made_up += u_px && camera.contains(*u_px, -1.0 - kMargin_px) ? 0 : 1;
      if (!u_px) continue;
      const Eigen::Vector2d p_px(points.u_px[0], points.v_px[0]);
      result.worst_px = std::max(result.worst_px, (p_px - *u_px).norm());
    }
  }
  return result;
}

TEST(PointProjection, AgreesWithTheCameraModel) {
  const auto result = compare({}, 60.0);
  EXPECT_GT(result.kept, 2'000);
  EXPECT_LT(result.worst_px, kAgreement_px);
  EXPECT_EQ(result.lost, 0);
  EXPECT_EQ(result.made_up, 0);
}

TEST(PointProjection, AgreesWithTheCameraModelForVeryWideLenses) {
  for (const double half_diagonal_deg : {60.0, 70.0, 80.0, 84.0, 86.0, 88.0, 90.0, 92.0, 100.0}) {
    const auto camera = fisheye(half_diagonal_deg);
    const auto result = compare(camera, 84.9);
    EXPECT_GT(result.kept, 10'000) << half_diagonal_deg;
    EXPECT_LT(result.worst_px, kAgreement_px) << half_diagonal_deg;
    EXPECT_EQ(result.lost, 0) << half_diagonal_deg;
    EXPECT_EQ(result.made_up, 0) << half_diagonal_deg;
    EXPECT_EQ(compare(camera, 89.9).kept, compare(camera, 85.1).kept)
        << half_diagonal_deg << ": beyond 85 degrees nothing is kept";
  }
}

/// k1 = -0.3: beyond a radius of 1 / sqrt(0.9), at 0.70, the model folds over. The corners are at
/// 0.8 and show nothing; what lies just within the fold is seen all the same.
TEST(PointProjection, KeepsWhatLiesWithinTheFoldOfTheLens) {
  auto camera = fisheye(60.0);
  camera.distortion_model = "plumb_bob";
  camera.distortion = {-0.3};
  camera.fx_px = camera.fy_px = 500.0;
  const auto result = compare(camera, 46.4);  // tan(46.5 degrees) = 1.054
  EXPECT_LT(result.worst_px, kAgreement_px);
  EXPECT_EQ(result.lost, 0);
  EXPECT_EQ(result.made_up, 0);
}

}  // namespace
}  // namespace camvox::depth
