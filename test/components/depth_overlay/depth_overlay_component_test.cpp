#include "camvox/depth_overlay/depth_overlay_component.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "camvox/component/fake_context.hpp"

namespace camvox {
namespace {

namespace fs = std::filesystem;
using camvox_interfaces::msg::DepthImage;
using camvox_interfaces::msg::FrameImage;
using ::testing::HasSubstr;

constexpr std::uint32_t kWidth = 640, kHeight = 48;
constexpr std::int64_t kSecond_ns = 1'000'000'000;

class DepthOverlayTest : public testing::Test {
 protected:
  DepthOverlayTest() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    fake_.set_parameter("output_dir", folder_.string());
  }
  ~DepthOverlayTest() override { fs::remove_all(folder_); }

  /// Depth of a frame: its number in metres, everywhere.
  void send_frame(std::uint64_t frame_id, bool with_depth = true) {
    fake_.send<FrameImage>("frame_image", [&](FrameImage& image) {
      image.header().frame_id(frame_id);
      image.header().stamp_ns(static_cast<std::int64_t>(frame_id) * kSecond_ns);
      image.width_px(kWidth);
      image.height_px(kHeight);
      image.row_step_bytes(kWidth);
      image.encoding(camvox_interfaces::msg::ENCODING_MONO8);
      image.data_count(kWidth * kHeight);
    });
    fake_.send<DepthImage>("depth_image", [&](DepthImage& depth) {
      depth.header().frame_id(frame_id);
      depth.width_px(kWidth);
      depth.height_px(kHeight);
      depth.depth_m_count(with_depth ? kWidth * kHeight : 0);
      depth.sigma_m_count(depth.depth_m_count());
      for (std::uint32_t i = 0; i < depth.depth_m_count(); ++i) {
        depth.depth_m()[i] = static_cast<float>(frame_id);
      }
    });
  }
  /// What the component says at its end.
  [[nodiscard]] std::string end(DepthOverlayComponent& component) {
    component.stop();
    fake_.verify_nothing_left();
    return fake_.log_entries().empty() ? "" : fake_.log_entries().back().text;
  }

  fs::path folder_ = fs::temp_directory_path() / ("camvox_overlay_" + std::to_string(getpid()));
  FakeContext fake_;
};

TEST_F(DepthOverlayTest, DrawsTheLastFrameWithDepth) {
  DepthOverlayComponent component(fake_);
  for (const std::uint64_t id : {1, 2, 3}) send_frame(id);
  send_frame(4, false);
  EXPECT_THAT(end(component), HasSubstr("frame 3 "));
  const auto picture = cv::imread(folder_ / "depth_overlay.png");
  EXPECT_EQ(picture.cols, static_cast<int>(kWidth));
  EXPECT_FALSE(fake_.exit_requested());
}

TEST_F(DepthOverlayTest, DrawsTheFrameThatWasAskedForAndEnds) {
  fake_.set_parameter("frame_id", std::int64_t{2});
  fake_.set_parameter("file", (folder_ / "own.png").string());
  fake_.set_parameter("exit_when_found", true);
  DepthOverlayComponent component(fake_);
  send_frame(1);
  EXPECT_FALSE(fake_.exit_requested());
  send_frame(2, false);
  EXPECT_TRUE(fake_.exit_requested());
  send_frame(3);
  EXPECT_THAT(end(component), HasSubstr("no depth"));
  EXPECT_TRUE(fs::exists(folder_ / "own.png"));
  EXPECT_FALSE(fs::exists(folder_ / "depth_overlay.png"));
}

TEST_F(DepthOverlayTest, DrawsTheFrameNearestToAStamp) {
  fake_.set_parameter("stamp_ns", std::int64_t{2 * kSecond_ns + 400'000'000});
  fake_.set_parameter("exit_when_found", true);
  DepthOverlayComponent component(fake_);
  for (const std::uint64_t id : {1, 2, 3}) send_frame(id);
  EXPECT_TRUE(fake_.exit_requested());
  EXPECT_THAT(end(component), HasSubstr("frame 2 "));
}

// Lockstep replay waits for it: what it is behind with, it would lose.
TEST_F(DepthOverlayTest, TellsWhichFramesItHasSeen) {
  DepthOverlayComponent component(fake_);
  send_frame(1);
  send_frame(2, false);
  const auto done = fake_.published<camvox_interfaces::msg::Progress>("progress");
  ASSERT_EQ(done.size(), 2U);
  EXPECT_EQ(done[0]->header().frame_id(), 1U);
  EXPECT_EQ(done[1]->header().frame_id(), 2U);
  component.stop();
}

TEST_F(DepthOverlayTest, SaysThatThereIsNoSuchFrame) {
  fake_.set_parameter("frame_id", std::int64_t{9});
  DepthOverlayComponent component(fake_);
  for (const std::uint64_t id : {1, 2, 3}) send_frame(id);
  EXPECT_THAT(end(component), HasSubstr("no frame 9; frames go from 1 to 3"));
  EXPECT_FALSE(fs::exists(folder_ / "depth_overlay.png"));
}

TEST_F(DepthOverlayTest, AStampFarFromAllFramesGivesNoPicture) {
  fake_.set_parameter("stamp_ns", std::int64_t{20 * kSecond_ns});
  DepthOverlayComponent component(fake_);
  send_frame(3);
  EXPECT_THAT(end(component), HasSubstr("the nearest is at 3.000000000 s"));
  EXPECT_FALSE(fs::exists(folder_ / "depth_overlay.png"));
}

TEST_F(DepthOverlayTest, WithoutFramesAndWithoutFolderNothingBreaks) {
  {
    DepthOverlayComponent component(fake_);
    EXPECT_THAT(end(component), HasSubstr("no frame"));
  }
  FakeContext fake;
  DepthOverlayComponent component(fake);
  component.stop();
  EXPECT_TRUE(fake.log_entries().empty());
}

TEST_F(DepthOverlayTest, WhatCannotBeWrittenIsSaid) {
  fake_.set_parameter("file", (folder_ / "no" / "folder.png").string());
  DepthOverlayComponent component(fake_);
  send_frame(1);
  EXPECT_THAT(end(component), HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace camvox
