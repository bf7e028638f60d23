#include "camvox/trajectory/trajectory_file.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>

namespace camvox::trajectory {
namespace {

using ::testing::HasSubstr;

std::filesystem::path file_with(const std::string& text) {
  const auto path = std::filesystem::path(testing::TempDir()) /
                    ("trajectory_" + std::to_string(getpid()) + ".txt");
  std::ofstream(path) << text;
  return path;
}

Trajectory some_trajectory() {
  Trajectory trajectory;
  for (int i = 0; i < 20; ++i) {
    geometry::Vector6d xi;
    xi << 0.1 * i, -0.05 * i, 0.02 * i, 1.0 * i, 2.0, -0.5 * i;
    trajectory.push_back({1'700'000'000'123'456'789 + i * 100'000'001, geometry::SE3::exp(xi)});
  }
  return trajectory;
}

TEST(TumFile, ReadsWhatItWroteToTheNanosecond) {
  const auto written = some_trajectory();
  const auto file = file_with("");
  ASSERT_TRUE(write_tum(file, written).ok());
  const auto read = read_trajectory(file);
  ASSERT_TRUE(read.ok()) << read.status().message();
  ASSERT_EQ(read->size(), written.size());
  for (std::size_t i = 0; i < written.size(); ++i) {
    EXPECT_EQ((*read)[i].stamp_ns, written[i].stamp_ns);
    EXPECT_LT(geometry::local((*read)[i].T_world_body, written[i].T_world_body).norm(), 1e-8);
  }
}

TEST(TumFile, KnowsCommentsBlankLinesAndShortStamps) {
  const auto read = read_tum(file_with("# stamp\n\n1.5 1 2 3 0 0 0 1 # start\n 2 4 5 6 0 0 0 1\n"));
  ASSERT_TRUE(read.ok()) << read.status().message();
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ((*read)[0].stamp_ns, 1'500'000'000);
  EXPECT_EQ((*read)[1].stamp_ns, 2'000'000'000);
  EXPECT_EQ((*read)[1].T_world_body.translation().z(), 6.0);
}

TEST(TumFile, OfEqualStampsTheFirstCounts) {
  const auto read = read_tum(file_with("1 1 0 0 0 0 0 1\n1 2 0 0 0 0 0 1\n2 3 0 0 0 0 0 1\n"));
  ASSERT_TRUE(read.ok()) << read.status().message();
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ((*read)[0].T_world_body.translation().x(), 1.0);
}

TEST(KittiFile, ReadsWhatItWrote) {
  const auto written = some_trajectory();
  const auto file = file_with("");
  ASSERT_TRUE(write_kitti(file, written).ok());
  const auto read = read_trajectory(file);
  ASSERT_TRUE(read.ok()) << read.status().message();
  ASSERT_EQ(read->size(), written.size());
  EXPECT_EQ((*read)[3].stamp_ns, 300'000'000);
  EXPECT_LT(geometry::local((*read)[19].T_world_body, written[19].T_world_body).norm(), 1e-7);
}

TEST(TrajectoryFile, ErrorsNameFileLineAndFault) {
  const auto message = [](const std::string& text) {
    return read_trajectory(file_with(text)).status().message();
  };
  EXPECT_THAT(message("1 2 3\n"), HasSubstr(".txt:1: 3 columns, not 8"));
  EXPECT_THAT(message("1 1 2 3 0 0 0 1\n2 1 x 3 0 0 0 1\n"), HasSubstr(":2: not a number"));
  EXPECT_THAT(message("1 1 2 nan 0 0 0 1\n"), HasSubstr(":1: not a number"));
  EXPECT_THAT(message("1 1 2 3 0 0 0 2\n"), HasSubstr(":1: not a unit quaternion"));
  EXPECT_THAT(message("2 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1\n"), HasSubstr(":2: the stamp is before"));
  EXPECT_THAT(message("1 0 0 0 0 2 0 0 0 0 1 0\n"), HasSubstr(":1: its left 3x3 part"));
  EXPECT_THAT(read_tum("/no/such/file").status().message(), HasSubstr("cannot be read"));
  EXPECT_THAT(read_tum("/tmp").status().message(), HasSubstr("cannot be read"));
}

TEST(TrajectoryFile, AFullDiskLeavesTheOldFile) {
  EXPECT_FALSE(write_tum("/no/such/folder/file.tum", some_trajectory()).ok());
}

TEST(TrajectoryFile, EmptyIsEmpty) {
  const auto read = read_trajectory(file_with(""));
  ASSERT_TRUE(read.ok());
  EXPECT_TRUE(read->empty());
}

}  // namespace
}  // namespace camvox::trajectory
