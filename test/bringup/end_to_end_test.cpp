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
namespace fs = std::filesystem;

class EndToEnd : public CommandFixture {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::path(::testing::TempDir()) / ("end_to_end_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    const std::string words = std::string(CAMVOX_COMMAND) +
                              " simulate demo --set duration_s=4.0 -o " + recording().string() +
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

// 4 s and some metres of a drive: the bound is far above the few millimetres that are measured, and
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
  for (const auto* name : {"trajectory.tum", "odometry.tum", "keyframes.tum", "dense_map.ply"}) {
    const auto bytes = text(folder_ / "first" / name);
    EXPECT_FALSE(bytes.empty()) << name;
    EXPECT_EQ(bytes, text(folder_ / "second" / name)) << name << " differs between two runs";
  }
  const auto report =
      command({"report", folder_ / "first", "--reference", recording() / "truth_body.tum"});
  EXPECT_EQ(report.exit_code, 0) << report.output;
  EXPECT_THAT(text(folder_ / "first" / "report.html"), HasSubstr("APE rmse"));
}

TEST_F(EndToEnd, WithoutLidarNothingIsTrackedAndNothingBreaks) {
  const auto result = run_all(
      folder_ / "blind", {"--set", "replay.topics=[/camera/image_raw/compressed, /livox/imu]"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("0 of "));
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
