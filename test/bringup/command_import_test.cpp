#include "command_fixture.hpp"

namespace camvox::bringup {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class CommandImport : public CommandFixture {
 protected:
  CommandImport() { fs::remove_all(bag_); }
  ~CommandImport() override { fs::remove_all(bag_); }

  fs::path bag_ = fs::path(::testing::TempDir()) / ("camvox_import_" + std::to_string(getpid()));
};

TEST_F(CommandImport, WritesABagAndPrintsATable) {
  const auto csv = write("points.csv", "1,2,3,4\n0,0,0,0\n4,5,6,7\n");
  const auto done = command({"import", "livox-csv", csv, "-o", bag_, "--compression", "zstd"});
  EXPECT_EQ(done.exit_code, 0) << done.output;
  EXPECT_THAT(done.output, HasSubstr("1 messages"));
  EXPECT_THAT(done.output, HasSubstr("topic         messages  Hz  type\n"));
  EXPECT_THAT(done.output,
              HasSubstr("/livox/lidar         1   -  livox_ros_driver2/msg/CustomMsg\n"));
  EXPECT_THAT(done.output, HasSubstr("left out:\n  points (1): (0, 0, 0): no return\n"));
  EXPECT_THAT(done.output, Not(HasSubstr("%")));  // no bar in a log
  EXPECT_TRUE(fs::exists(bag_ / "metadata.yaml"));

  const auto again = command({"import", "livox-csv", csv, "-o", bag_});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.output, HasSubstr("exists; choose another output"));
}

TEST_F(CommandImport, FailsOnBrokenInputAndWrongWords) {
  const auto broken = command({"import", "livox-csv", write("bad.csv", "1,2,3,x\n"), "-o", bag_});
  EXPECT_EQ(broken.exit_code, 1);
  EXPECT_THAT(broken.output, HasSubstr("bad.csv:1: 'x' is not a number"));
  EXPECT_FALSE(fs::exists(bag_));
  EXPECT_EQ(command({"import", "kitti-raw", "/nowhere", "-o", bag_}).exit_code, 1);
  EXPECT_EQ(command({"import", "rosbag1", write("x.bag", "no bag"), "-o", bag_}).exit_code, 1);
  EXPECT_EQ(command({"import"}).exit_code, 2);
  EXPECT_EQ(command({"import", "tum-rgbd", "x", "--intrinsics", "525,525,319"}).exit_code, 2);
  EXPECT_EQ(command({"import", "tum-rgbd", "/nowhere", "--intrinsics", "fr1"}).exit_code, 1);
  EXPECT_EQ(command({"import", "livox-csv"}).exit_code, 2);
  EXPECT_EQ(command({"import", "livox-csv", "x.csv", "--compression", "rar"}).exit_code, 2);
}

}  // namespace
}  // namespace camvox::bringup
