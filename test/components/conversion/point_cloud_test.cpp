#include "camvox/conversion/point_cloud.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace camvox::conversion {
namespace {

TEST(PointCloudTest, PointsAreXyzAndPackedColour) {
  sensor_msgs::msg::PointCloud2 cloud;
  write_points({{{1.0F, 2.0F, 3.0F}, {0, 0, 0}}, {{-4.0F, 5.0F, 6.5F}, {1, 2, 255}}}, cloud);
  EXPECT_EQ(cloud.width(), 2U);
  EXPECT_EQ(cloud.height(), 1U);
  ASSERT_EQ(cloud.fields().size(), 4U);
  EXPECT_EQ(cloud.fields()[2].name(), "z");
  ASSERT_EQ(cloud.data().size(), 2 * cloud.point_step());
  const auto* row = cloud.data().data() + cloud.point_step();
  float z = 0.0F;
  std::uint32_t rgb = 0;
  std::memcpy(&z, row + cloud.fields()[2].offset(), 4);
  std::memcpy(&rgb, row + cloud.fields()[3].offset(), 4);
  EXPECT_EQ(z, 6.5F);
  EXPECT_EQ(rgb, 0x0102FFU);
}

TEST(PointCloudTest, NoPointsGiveAnEmptyCloud) {
  sensor_msgs::msg::PointCloud2 cloud;
  write_points({}, cloud);
  EXPECT_EQ(cloud.width(), 0U);
  EXPECT_TRUE(cloud.data().empty());
}

}  // namespace
}  // namespace camvox::conversion
