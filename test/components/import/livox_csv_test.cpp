#include "camvox/import/livox_csv.hpp"

#include <sstream>

#include "camvox/interfaces/livox_ros_driver2.hpp"
#include "imported_bag.hpp"

namespace camvox::import {
namespace {

using livox_ros_driver2::msg::CustomMsg;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class LivoxCsv : public ::testing::Test {
 protected:
  LivoxCsv() { options_.output = output_; }
  storage::Result<ImportReport> run(const std::string& text) {
    return import_livox_csv(folder_.write("points.csv", text), options_);
  }
  std::string error(const std::string& text) { return error_of(run(text), output_); }
  [[nodiscard]] std::vector<Logged<CustomMsg>> messages() const {
    return ImportedBag(output_).messages<CustomMsg>("/livox/lidar");
  }

  TemporaryFolder folder_;
  fs::path output_ = folder_.path() / "bag";
  LivoxCsvOptions options_;
};

TEST_F(LivoxCsv, RowsWithoutTimesFollowTheFiringOrder) {
  const auto report = run("1,2,3,4,\n0,0,0,0,\n-1.5,0,0.25,255,\n");
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_EQ(report->left_out.at(0).count, 1U);
  EXPECT_EQ(report->notes.size(), 3U);
  const auto found = messages();
  ASSERT_EQ(found.size(), 1U);
  const auto& points = found[0].message.points();
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(found[0].message.point_num(), 2U);
  EXPECT_EQ(found[0].log_time_ns, 2 * 4167);
  EXPECT_EQ(points[1].offset_time(), 2U * 4167);  // the shot without return took its time
  EXPECT_EQ(points[1].line(), 2);
  EXPECT_EQ(points[1].x(), -1.5F);
  EXPECT_EQ(points[1].reflectivity(), 255);
}

TEST_F(LivoxCsv, NamedColumnsBringTimesTagsAndLines) {
  options_.start_ns = 5'000'000'000;
  ASSERT_TRUE(run("Line,Tag,X,Y,Z,Reflectivity,offset_time\n3,16,1,2,3,9,100\n"
                  "5,32,4,5,6,8,99999999\n1,0,7,8,9,7,250000000\n")
                  .ok());
  const auto found = messages();
  ASSERT_EQ(found.size(), 2U);  // 100 ms each
  EXPECT_EQ(stamp_ns(found[0].message), 5'000'000'100);
  EXPECT_EQ(found[0].message.timebase(), 5'000'000'100U);
  EXPECT_EQ(found[0].message.points()[0].tag(), 16);
  EXPECT_EQ(found[0].message.points()[1].line(), 5);
  EXPECT_EQ(found[0].message.points()[1].offset_time(), 99'999'899U);
  EXPECT_EQ(found[1].message.timebase(), 5'250'000'000U);
}

TEST_F(LivoxCsv, CutsLongFilesIntoMessages) {
  std::string text;
  for (int i = 0; i < 50'000; ++i) text += "1,1,1,1\n";
  ASSERT_TRUE(run(text).ok());
  const auto found = messages();
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].message.points().size(), 23'999U);  // 100 ms / 4167 ns, rounded up
  for (std::size_t i = 1; i < found.size(); ++i) {
    const auto& before = found[i - 1].message;
    EXPECT_EQ(found[i].message.timebase(),
              before.timebase() + before.points().back().offset_time() + 4167);
  }
}

TEST_F(LivoxCsv, NamesTheLineOfWhatIsBroken) {
  EXPECT_THAT(error("1,2,3,4\n1,2,3\n"), HasSubstr("points.csv:2: has 3 fields, not 4"));
  EXPECT_THAT(error("1,2,3,4\n1,2,x,4\n"), HasSubstr("points.csv:2: 'x' is not a number"));
  EXPECT_THAT(error("1,2,3,4\n1,2,inf,4\n"), HasSubstr("points.csv:2: 'inf' is not a number"));
  EXPECT_THAT(error("1,2,3,300\n"), HasSubstr("points.csv:1: 300 is not in 0 to 255"));
  EXPECT_THAT(error("12000,2,3,4\n"), HasSubstr("points.csv:1: 12000 m is no distance"));
  EXPECT_THAT(error("x,y,z\n"), HasSubstr("points.csv:1: needs columns"));
  EXPECT_THAT(error("x,y,z,intensity,offset_time\n1,1,1,1,9\n1,1,1,1,8\n"),
              HasSubstr("points.csv:3: offset_time goes back"));
  EXPECT_THAT(error(""), HasSubstr("nothing that can be imported"));
  EXPECT_THAT(error("0,0,0,0\n"), HasSubstr("nothing that can be imported"));
  EXPECT_THAT(error(std::string(3 << 20, '\0')), HasSubstr("points.csv:1: the line is too long"));
}

TEST(LivoxFrame, IsOneMessageOfTheFilesPoints) {
  const fs::path data = fs::path(SHARED_DATA) / "livox_frame";
  if (!fs::exists(data)) GTEST_SKIP() << "no recording at " << data;
  const fs::path file = *fs::directory_iterator(data);
  const TemporaryFolder folder;
  LivoxCsvOptions options;
  options.output = folder.path() / "bag";
  const auto report = import_livox_csv(file, options);
  ASSERT_TRUE(report.ok()) << report.status().message();
  const auto found = ImportedBag(options.output).messages<CustomMsg>("/livox/lidar");
  ASSERT_EQ(found.size(), 1U);
  const auto& points = found[0].message.points();
  EXPECT_EQ(points.size(), 20'900U);
  std::ifstream stream(file);
  std::string line;
  for (std::size_t i = 0; std::getline(stream, line); ++i) {
    std::replace(line.begin(), line.end(), ',', ' ');
    double x = 0, y = 0, z = 0, intensity = 0;
    std::istringstream(line) >> x >> y >> z >> intensity;
    ASSERT_EQ(points[i].x(), static_cast<float>(x)) << i;
    ASSERT_EQ(points[i].y(), static_cast<float>(y)) << i;
    ASSERT_EQ(points[i].z(), static_cast<float>(z)) << i;
    ASSERT_EQ(points[i].reflectivity(), intensity) << i;
    ASSERT_EQ(points[i].offset_time(), 4167 * i);
    ASSERT_EQ(points[i].line(), i % 6);
  }
}

}  // namespace
}  // namespace camvox::import
