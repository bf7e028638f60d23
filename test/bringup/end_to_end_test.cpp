// The whole pipeline as a user runs it: simulate, run, evaluate, report.
#include <cstdlib>
#include <fstream>
#include <thread>

#include "camvox/trajectory/alignment.hpp"
#include "camvox/trajectory/metrics.hpp"
#include "camvox/trajectory/trajectory_file.hpp"
#include "command_fixture.hpp"

namespace camvox::bringup {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

class EndToEnd : public CommandFixture {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::path(::testing::TempDir()) / ("end_to_end_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    const std::string words = std::string(CAMVOX_COMMAND) +
                              " simulate demo --set duration_s=5.0 -o " + recording().string() +
                              " > /dev/null";
    ASSERT_EQ(std::system(words.c_str()), 0);
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static fs::path recording() { return folder_ / "recording"; }

  [[nodiscard]] Result run_all(const fs::path& output, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"run",
                                      "replay.yaml",
                                      "--bag",
                                      recording(),
                                      "--parameters",
                                      recording() / "rig.yaml",
                                      "--lockstep",
                                      "--out",
                                      output};
    words.insert(words.end(), more.begin(), more.end());
    return command(words);
  }
  static std::string text(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  inline static fs::path folder_;
};

// 5 s and some metres of a drive: the bound is far above the few millimetres that are measured, and
// far below what a wrong transform or time would give.
TEST_F(EndToEnd, TracksEveryFrameAndRepeatsItselfBitByBit) {
  const auto first = run_all(folder_ / "first");
  ASSERT_EQ(first.exit_code, 0) << first.output;
  const auto second = run_all(folder_ / "second");
  ASSERT_EQ(second.exit_code, 0) << second.output;
  const auto reference = trajectory::read_tum(recording() / "truth_body.tum");
  const auto estimate = trajectory::read_tum(folder_ / "first" / "trajectory.tum");
  ASSERT_TRUE(reference.ok() && estimate.ok());
  // The last frame may lack the end of its scan.
  EXPECT_GE(estimate->size() + 2, reference->size()) << first.output;
  const auto pairs = trajectory::associate(*reference, *estimate);
  ASSERT_EQ(pairs.size(), estimate->size());
  const auto origin = trajectory::align(pairs, trajectory::Alignment::kOrigin);
  const auto errors = trajectory::statistics(
      trajectory::absolute_errors_m(trajectory::transformed(*origin, pairs)));
  EXPECT_LT(errors.max, 0.1);
  for (const auto* name :
       {"trajectory.tum", "odometry.tum", "keyframes.tum", "dense_map.ply", "map.mcap"}) {
    const auto bytes = text(folder_ / "first" / name);
    EXPECT_FALSE(bytes.empty()) << name;
    EXPECT_EQ(bytes, text(folder_ / "second" / name)) << name << " differs between two runs";
  }
  const auto report =
      command({"report", folder_ / "first", "--reference", recording() / "truth_body.tum"});
  EXPECT_EQ(report.exit_code, 0) << report.output;
  EXPECT_THAT(text(folder_ / "first" / "report.html"), HasSubstr("APE rmse"));
}

// The second run starts nowhere in particular; what it says is to be in the first run's map frame.
TEST_F(EndToEnd, LocalisesInTheMapOfAnotherRun) {
  const auto mapped = run_all(folder_ / "mapped");
  ASSERT_EQ(mapped.exit_code, 0) << mapped.output;
  const auto map = folder_ / "mapped" / "map.mcap";
  const auto map_bytes = text(map);
  const auto output = folder_ / "localised";
  const auto localised = run_all(output, {"--map", map, "--localisation-only"});
  ASSERT_EQ(localised.exit_code, 0) << localised.output;
  EXPECT_EQ(map_bytes, text(map));
  EXPECT_FALSE(fs::exists(output / "map.mcap"));

  const auto truth = trajectory::read_tum(recording() / "truth_body.tum");
  const auto first = trajectory::read_tum(folder_ / "mapped" / "trajectory.tum");
  const auto second = trajectory::read_tum(output / "trajectory.tum");
  ASSERT_TRUE(truth.ok() && first.ok() && second.ok());
  EXPECT_GE(second->size() + 15, first->size()) << "found within 1.5 s";
  const auto pairs = trajectory::associate(*truth, *second);
  ASSERT_EQ(pairs.size(), second->size());
  const auto first_pairs = trajectory::associate(*truth, *first);
  const auto origin = trajectory::align(first_pairs, trajectory::Alignment::kOrigin);
  const auto errors = trajectory::statistics(
      trajectory::absolute_errors_m(trajectory::transformed(*origin, pairs)));
  EXPECT_LT(errors.max, 0.1);
  EXPECT_THAT(text(output / "frames.csv"), HasSubstr(",localisation_only,1,"));
  EXPECT_THAT(text(output / "frames.csv"), Not(HasSubstr(",ok,")));
}

TEST_F(EndToEnd, MapsOnInTheMapOfAnotherRun) {
  ASSERT_EQ(run_all(folder_ / "before").exit_code, 0);
  const auto map = folder_ / "before" / "map.mcap";
  for (const auto* name : {"resumed", "resumed_again"}) {
    const auto resumed = run_all(folder_ / name, {"--map", map});
    ASSERT_EQ(resumed.exit_code, 0) << resumed.output;
    EXPECT_THAT(resumed.output, Not(HasSubstr("not taken")));
  }
  const auto bytes = text(folder_ / "resumed" / "map.mcap");
  EXPECT_NE(bytes, text(map));
  EXPECT_EQ(bytes, text(folder_ / "resumed_again" / "map.mcap"));
}

TEST_F(EndToEnd, AMapThatIsBrokenEndsTheRun) {
  const auto map = folder_ / "broken.mcap";
  std::ofstream(map) << "no map at all";
  const auto result = run_all(folder_ / "refused", {"--map", map});
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_THAT(result.output, HasSubstr("broken.mcap: the map cannot be loaded: not an MCAP file"));
}

/// What can be computed without a topic is, and the log names the topic.
TEST_F(EndToEnd, ATopicThatTheRecordingLacksIsNamed) {
  struct Case {
    const char* name;
    const char* topics;
    const char* missing;
    const char* tracked;
    int exit_code;
  };
  for (const Case& one : {Case{"no_lidar",
                               "/camera/image_raw/compressed, /livox/imu",
                               "'lidar' (topic /livox/lidar)",
                               "[results]: 0 of 51 frames",
                               3},
                          Case{"no_image",
                               "/livox/lidar, /livox/imu",
                               "'image' (topic /camera/image_raw or /camera/image_raw/compressed)",
                               "[results]: 0 of 0 frames",
                               3},
                          Case{"no_imu",
                               "/camera/image_raw/compressed, /livox/lidar",
                               "'imu' (topic /livox/imu)",
                               "[results]: 50 of 51 frames",
                               0}}) {
    const auto result =
        run_all(folder_ / one.name, {"--set", "replay.topics=[" + std::string(one.topics) + "]"});
    EXPECT_EQ(result.exit_code, one.exit_code) << "3: no frame tracked\n" << result.output;
    EXPECT_THAT(result.output, HasSubstr("nothing came on input " + std::string(one.missing)));
    EXPECT_THAT(result.output, HasSubstr(one.tracked)) << one.name;
    EXPECT_TRUE(fs::exists(folder_ / one.name / "frames.csv"));
  }
}

TEST_F(EndToEnd, ACalibrationThatIsNotGivenIsSaid) {
  const auto output = folder_ / "default_rig";
  const std::vector<std::string> words = {
      "run", "replay.yaml", "--bag", recording(), "--lockstep", "--out", output};
  const auto result = command(words);
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("no calibration `camera` is given"));
  EXPECT_THAT(result.output, HasSubstr("no calibration `rig` is given"));
  const auto given = run_all(folder_ / "given_rig", {"--set", "replay.duration_s=0.5"});
  EXPECT_THAT(given.output, ::testing::Not(HasSubstr("no calibration")));
}

/// The disk holds the config and little more.
TEST_F(EndToEnd, AFullDiskIsSaidAndGivesAnExitCode) {
  const auto disk = folder_ / "disk";
  fs::create_directory(disk);
  const std::string script =
      "mount -t tmpfs -o size=256k none " + disk.string() +
      " && " CAMVOX_COMMAND " run replay.yaml --bag " + recording().string() + " --parameters " +
      (recording() / "rig.yaml").string() + " --lockstep --out " + (disk / "out").string() +
      "; echo exit code $?; ls -A " + (disk / "out").string() + "; echo end of list";
  test::ChildProcess child({"unshare", "--user", "--map-root-user", "--mount", "sh", "-c", script},
                           {{"ROS_DOMAIN_ID", std::to_string(test::own_domain())}});
  EXPECT_EQ(child.wait(std::chrono::seconds(120)), 0);
  const auto output = child.output();
  if (output.find("unshare:") != std::string::npos || output.find("mount:") != std::string::npos) {
    GTEST_SKIP() << "no private mounts here: " << output;
  }
  EXPECT_THAT(output, HasSubstr("No space left on device"));
  EXPECT_THAT(output, HasSubstr("dense_map.ply: cannot be written"));
  EXPECT_THAT(output, HasSubstr("[dense_map]: while stopping: not all of the dense map was saved"));
  EXPECT_THAT(output, HasSubstr("exit code 3\n"));
  EXPECT_THAT(output, ::testing::Not(HasSubstr("dense_map.ply\n"))) << "a file that is cut short";
}

TEST_F(EndToEnd, WhatWasComputedIsSavedOnCtrlC) {
  const auto output = folder_ / "cut";
  container_ = begin({"run",
                      "replay.yaml",
                      "--bag",
                      recording(),
                      "--parameters",
                      recording() / "rig.yaml",
                      "--out",
                      output});
  ASSERT_TRUE(container_->wrote("components on domain")) << container_->output();
  std::this_thread::sleep_for(std::chrono::milliseconds(2500));
  EXPECT_EQ(stop(), 0) << container_->output();
  EXPECT_TRUE(fs::exists(output / "trajectory.tum")) << container_->output();
  EXPECT_TRUE(fs::exists(output / "timing.csv"));
}

}  // namespace
}  // namespace camvox::bringup
