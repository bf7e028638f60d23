#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "camvox/calibration/lidar_edges.hpp"

// Outlines in one turn of a spinning lidar. Truth is a board before a wall, in closed form.
namespace camvox::calibration {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kStep_deg = 0.18;  ///< As a Velodyne HDL-64E at 10 Hz,
constexpr double kLine_deg = 0.4;   ///< and between its lines.
constexpr double kBoard_m = 8.0;
constexpr double kWall_m = 20.0;
constexpr double kHalfWidth_m = 0.5;
constexpr double kLean = 0.3;  ///< To the left, m for each m up.

/// Scan lines, one after the other, of a leaning board and a wall that both face the lidar.
std::vector<Eigen::Vector4f> scan() {
  std::vector<Eigen::Vector4f> points;
  for (double elevation_deg = -8.0; elevation_deg <= 8.0; elevation_deg += kLine_deg) {
    for (double azimuth_deg = -40.0; azimuth_deg <= 40.0; azimuth_deg += kStep_deg) {
      const double y = -std::tan(azimuth_deg * kDegree);
      const double z = std::tan(elevation_deg * kDegree) / std::cos(azimuth_deg * kDegree);
      const bool board = std::abs(kBoard_m * (y - kLean * z)) < kHalfWidth_m;
      const double x = board ? kBoard_m : kWall_m;
      points.push_back(Eigen::Vector4d(x, x * y, x * z, 0.5).cast<float>());
    }
  }
  return points;
}

/// The camera's axes: z along the lidar's x, y down.
LidarView view() {
  LidarView view;
  view.R_view_lidar << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return view;
}

std::vector<LidarEdge> outlines_of(const std::vector<Eigen::Vector4f>& points) {
  auto edges = extract_lidar_edges(points, view(), {}).edges;
  std::erase_if(edges, [](const LidarEdge& edge) { return edge.kind != EdgeKind::kOutline; });
  return edges;
}

TEST(Outlines, LieOnTheBorderOfWhatIsNear) {
  const auto edges = outlines_of(scan());
  EXPECT_GT(edges.size(), 60U);  // 41 lines cross both sides
  for (const LidarEdge& edge : edges) {
    const Eigen::Vector3d& p = edge.p_lidar;
    const double side = p.y() > kLean * p.z() ? 1.0 : -1.0;
    const double border_y = kLean * p.z() + side * kHalfWidth_m;
    // Half a step, as a border lies anywhere between two returns.
    EXPECT_NEAR(p.y(), border_y, 0.6 * kStep_deg * kDegree * kBoard_m);
    EXPECT_NEAR(p.x(), kBoard_m, 0.05);
    const Eigen::Vector3d along = Eigen::Vector3d(0, kLean, 1).normalized();
    EXPECT_GT(std::abs(edge.tangent_lidar.dot(along)), 0.98);
    // A wider beam moves it outwards.
    EXPECT_NEAR(edge.widening_lidar(1, 0), side * kBoard_m, 0.1);
    EXPECT_TRUE(edge.widening_lidar.col(1).isZero());
  }
}

TEST(Outlines, AreNotMadeUpWhereTheOrderTellsNothing) {
  auto points = scan();
  std::mt19937 generator(1);
  std::shuffle(points.begin(), points.end(), generator);
  EXPECT_THAT(outlines_of(points), ::testing::SizeIs(::testing::Le(2)));
}

TEST(Outlines, LeavesHaveNone) {
  // What hangs before the wall is as wide as a return or three, here and there.
  auto points = scan();
  std::mt19937 generator(2);
  for (auto& point : points) {
    point *= static_cast<float>(kWall_m) / point.x();
    if (generator() % 5 == 0) point *= static_cast<float>(kBoard_m / kWall_m);
  }
  EXPECT_LT(outlines_of(points).size(), points.size() / 500);
}

}  // namespace
}  // namespace camvox::calibration
