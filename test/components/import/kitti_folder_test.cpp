#include <cmath>
#include <numbers>

#include "camvox/import/kitti_raw.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "imported_bag.hpp"

// The importer on small drives that are made here: what is missing, broken or unusual.
namespace camvox::import {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

const std::string kStamps = "2011-09-26 13:10:51.100000000\n2011-09-26 13:10:51.200000000\n";
const std::string kOxts =
    "49.0 8.4 114.0 0 0 1.5 0 0 10 0 0 0.1 0.2 9.8 0 0 0 0.01 0.02 0.03 0 0 0 0.1 0.03 4 8 4 4 0\n";

class KittiFolder : public ::testing::Test {
 protected:
  KittiFolder() {
    folder_.write("date/drive_a/oxts/timestamps.txt", kStamps);
    folder_.write("date/drive_a/oxts/data/0000000000.txt", kOxts);
    folder_.write("date/drive_a/oxts/data/0000000001.txt", kOxts);
  }
  storage::Result<ImportReport> run(const std::string& drive = {}) {
    options_.output = output_;
    options_.drive = drive;
    return import_kitti_raw(folder_.path() / "date", options_);
  }
  std::string error() { return error_of(run(), output_); }
  fs::path write(const std::string& name, const std::string& text) {
    return folder_.write("date/drive_a/" + name, text);
  }

  TemporaryFolder folder_;
  fs::path output_ = folder_.path() / "bag";
  KittiRawOptions options_;
};

TEST_F(KittiFolder, SaysWhatIsMissing) {
  const auto report = run();
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_THAT(report->missing,
              ElementsAre(HasSubstr("calib_cam_to_cam.txt"),
                          HasSubstr("calib_velo_to_cam.txt"),
                          HasSubstr("calib_imu_to_velo.txt"),
                          HasSubstr("image_02"),
                          HasSubstr("velodyne_points")));
  EXPECT_THAT(ImportedBag(output_).counts(),
              ElementsAre(Pair("/gnss/fix", 2),
                          Pair("/ground_truth/odometry", 2),
                          Pair("/imu/data", 2),
                          Pair("/tf_static", 1)));
}

TEST_F(KittiFolder, SaysWhichFramesAreMissingAndWhichFilesAreStrays) {
  fs::remove(folder_.path() / "date/drive_a/oxts/data/0000000001.txt");
  write("oxts/data/0000000007.txt", kOxts);
  write("image_03/timestamps.txt", kStamps);
  const auto report = run();
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_THAT(report->missing, ::testing::Contains("oxts: no file for 1 frames: 1"));
  ASSERT_EQ(report->left_out.size(), 2U);
  EXPECT_EQ(report->left_out[0].what, "oxts/data");
  EXPECT_EQ(report->left_out[1].what, "image_03");
}

TEST_F(KittiFolder, CloudWithoutSweepTimesHasNoTimeField) {
  write("velodyne_points/timestamps.txt", kStamps);
  write("velodyne_points/data/0000000000.bin", std::string(32, '\0'));
  write("velodyne_points/data/0000000001.bin", "");
  const auto report = run();
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_THAT(report->missing, ::testing::Contains(HasSubstr("start and end of 2 sweeps")));
  const auto clouds =
      ImportedBag(output_).messages<sensor_msgs::msg::PointCloud2>("/velodyne_points");
  EXPECT_EQ(clouds[0].message.point_step(), 16U);
  EXPECT_EQ(clouds[0].message.width(), 2U);
  EXPECT_EQ(clouds[1].message.width(), 0U);
}

TEST_F(KittiFolder, NamesFileAndLineOfWhatIsBroken) {
  write("oxts/data/0000000001.txt", "49.0 8.4 x\n");
  EXPECT_THAT(error(), HasSubstr("0000000001.txt:1: expected 30 fields, found 3"));
  auto broken = kOxts;
  broken.replace(0, 4, "4?.0");
  write("oxts/data/0000000001.txt", broken);
  EXPECT_THAT(error(), HasSubstr("0000000001.txt:1: '4?.0' is not a number"));
  write("oxts/data/0000000001.txt", "");
  EXPECT_THAT(error(), HasSubstr("0000000001.txt: is empty"));
  write("oxts/timestamps.txt", "2011-09-26 13:10:51.1\n2011-13-26 13:10:51.2\n");
  EXPECT_THAT(error(), HasSubstr("timestamps.txt:2: '2011-13-26 13:10:51.2' is no time stamp"));
}

TEST_F(KittiFolder, RefusesCutOffCloudsAndImages) {
  write("velodyne_points/timestamps.txt", kStamps);
  write("velodyne_points/data/0000000000.bin", std::string(33, '\0'));
  EXPECT_THAT(error(), HasSubstr("0000000000.bin: ends inside a point"));
  fs::remove_all(folder_.path() / "date/drive_a/velodyne_points");
  write("image_02/timestamps.txt", kStamps);
  write("image_02/data/0000000000.jpg", "\xff\xd8\xff\xe0 and then nothing");
  EXPECT_THAT(error(), HasSubstr("0000000000.jpg: is no complete JPEG or PNG"));
  write("image_02/data/0000000000.jpg", "");
  EXPECT_THAT(error(), HasSubstr("0000000000.jpg: is no complete JPEG or PNG"));
}

TEST_F(KittiFolder, RefusesABrokenCalibration) {
  folder_.write("date/calib_imu_to_velo.txt", "R: 1 0 0 0 1 0 0 0\nT: 0 0 0\n");
  EXPECT_THAT(error(), HasSubstr("calib_imu_to_velo.txt: R has 8 numbers, not 9"));
  folder_.write("date/calib_imu_to_velo.txt", "R: 1 0 0 0 2 0 0 0 1\nT: 0 0 0\n");
  EXPECT_THAT(error(), HasSubstr("R is no rotation"));
  folder_.write("date/calib_imu_to_velo.txt", "R 1 0 0\n");
  EXPECT_THAT(error(), HasSubstr("calib_imu_to_velo.txt:1: expected 'name: numbers'"));
}

TEST_F(KittiFolder, ChoosesTheDrive) {
  folder_.write("date/drive_b/oxts/timestamps.txt", kStamps);
  EXPECT_THAT(error(), HasSubstr("several drives, choose one: drive_a, drive_b"));
  EXPECT_TRUE(run("drive_a").ok());
  fs::remove_all(output_);
  options_.drive.clear();
  EXPECT_TRUE(import_kitti_raw(folder_.path() / "date" / "drive_a" / "", options_).ok());
  fs::remove_all(output_);
  EXPECT_THAT(import_kitti_raw(folder_.path(), options_).status().message(),
              HasSubstr("is neither a drive of KITTI raw"));
}

TEST_F(KittiFolder, LeavesAnExistingOutputAlone) {
  folder_.write("bag/notes.txt", "mine");
  const auto result = run();
  EXPECT_THAT(result.status().message(), HasSubstr("exists; choose another output"));
  EXPECT_TRUE(fs::exists(output_ / "notes.txt"));
}

TEST_F(KittiFolder, StopsWhenAskedAndLeavesNothing) {
  options_.progress = [](const ImportProgress& progress) { return progress.done == 0; };
  EXPECT_THAT(error(), HasSubstr("interrupted"));
}

TEST(SweepTime, IsLinearInEachHalf) {
  const SweepTimes sweep{1000, 1060, 1100};  // a trigger that is not in the middle
  constexpr double kPi = std::numbers::pi;
  EXPECT_EQ(sweep_time_ns(sweep, kPi), 0);
  EXPECT_EQ(sweep_time_ns(sweep, kPi / 2), 30);
  EXPECT_EQ(sweep_time_ns(sweep, 0.0), 60);
  EXPECT_EQ(sweep_time_ns(sweep, -kPi / 2), 80);
  EXPECT_EQ(sweep_time_ns(sweep, -kPi), 100);
}

// Small steps of the projection have the length that a sphere says.
TEST(Mercator, IsTrueToScaleAtItsLatitude) {
  constexpr double kDegree_m = 6378137.0 * std::numbers::pi / 180.0;
  const auto at = mercator(49.0, 8.4, 49.0);
  const auto north = mercator(49.0001, 8.4, 49.0);
  const auto east = mercator(49.0, 8.4001, 49.0);
  EXPECT_NEAR(north.north_m - at.north_m, 1e-4 * kDegree_m, 1e-3);
  EXPECT_NEAR(north.east_m, at.east_m, 1e-9);
  EXPECT_NEAR(
      east.east_m - at.east_m, 1e-4 * kDegree_m * std::cos(49.0 * std::numbers::pi / 180.0), 1e-3);
}

}  // namespace
}  // namespace camvox::import
