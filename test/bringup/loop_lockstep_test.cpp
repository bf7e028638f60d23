// Lockstep with a loop in it, on a real recording: the same bytes each time.
#include "command_fixture.hpp"

namespace camvox::bringup {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class LoopLockstep : public CommandFixture {
 protected:
  LoopLockstep() { fs::create_directories(folder_); }
  ~LoopLockstep() override { fs::remove_all(folder_); }

  /// The first frames of 7-Scenes RedKitchen: the camera leaves its first view and comes back.
  [[nodiscard]] Result import_frames(int count) const {
    const auto frames = folder_ / "frames";
    fs::create_directories(frames);
    for (const auto& entry : fs::directory_iterator(fs::path(SHARED_DATA) / "redkitchen")) {
      const auto name = entry.path().filename().string();
      const bool early = name.starts_with("frame-") && std::stoi(name.substr(6, 6)) < count;
      if (early) fs::create_symlink(fs::absolute(entry.path()), frames / name);
    }
    return command({"import", "7scenes", frames, "-o", folder_ / "bag"});
  }

  [[nodiscard]] Result run_all(const fs::path& output) {
    return command({"run",
                    "rgbd.yaml",
                    "--bag",
                    folder_ / "bag",
                    "--parameters",
                    folder_ / "bag" / "rig.yaml",
                    "--lockstep",
                    "--out",
                    output,
                    "--set",
                    "loop_closing.loop.min_path_m=0.3"});  // the path is 2 m long
  }
  static std::string text(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  fs::path folder_ = fs::path(::testing::TempDir()) / ("loop_lockstep_" + std::to_string(getpid()));
};

TEST_F(LoopLockstep, TwoRunsWithALoopAreTheSameBytes) {
  if (!fs::exists(fs::path(SHARED_DATA) / "redkitchen")) GTEST_SKIP() << "no recording redkitchen";
  const auto import = import_frames(300);
  ASSERT_EQ(import.exit_code, 0) << import.output;
  for (const auto* name : {"first", "second"}) {
    const auto run = run_all(folder_ / name);
    ASSERT_EQ(run.exit_code, 0) << run.output;
    // One line each from the pose graph and the full bundle adjustment.
    EXPECT_THAT(run.output, HasSubstr("pose graph: ")) << name;
    EXPECT_THAT(run.output, HasSubstr("closed, map epoch 1")) << name;
    EXPECT_THAT(run.output, HasSubstr("full bundle adjustment: ")) << name;
  }
  for (const auto* name : {"trajectory.tum", "odometry.tum", "keyframes.tum", "dense_map.ply"}) {
    const auto bytes = text(folder_ / "first" / name);
    EXPECT_FALSE(bytes.empty()) << name;
    EXPECT_EQ(bytes, text(folder_ / "second" / name)) << name << " differs between two runs";
  }
}

}  // namespace
}  // namespace camvox::bringup
