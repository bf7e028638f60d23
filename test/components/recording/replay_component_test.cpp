#include "camvox/recording/replay_component.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <fstream>
#include <optional>
#include <thread>

#include "bag_files.hpp"
#include "camvox/component/fake_context.hpp"
#include "camvox/interfaces/diagnostic_msgs.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Progress;
using diagnostic_msgs::msg::DiagnosticArray;
using recording::kStart_ns;
using recording::TemporaryFolder;
using std::chrono::steady_clock;

/// Lets the component's timers run until the condition holds; false at the deadline.
template <typename Condition>
bool run_until(FakeContext& fake, Condition&& condition) {
  const auto deadline = steady_clock::now() + std::chrono::seconds(20);
  while (!condition()) {
    if (steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    fake.advance(std::chrono::milliseconds(200));
  }
  return true;
}

bool logged(const FakeContext& fake, const std::string& text) {
  for (const auto& entry : fake.log_entries()) {
    if (entry.text.find(text) != std::string::npos) return true;
  }
  return false;
}

void send_progress(FakeContext& fake,
                   std::string_view component,
                   std::int64_t stamp_ns,
                   std::uint64_t frame_id) {
  fake.send<Progress>("progress", [&](Progress& progress) {
    progress.header().stamp_ns() = stamp_ns;
    progress.header().frame_id() = frame_id;
    component.copy(progress.component_name().data(), progress.component_name().size() - 1);
  });
}

std::vector<config::Problem> change(FakeContext& fake,
                                    const std::string& key,
                                    config::Value value) {
  return fake.change_parameters({{key, {std::move(value), {}}}});
}

bool sent(FakeContext& fake, const std::string& count) {
  return run_until(fake, [&] { return fake.diagnostics().status().values["sent"] == count; });
}

TEST(ReplayComponent, PublishesTheRecordedBytesUnderTheirNewNames) {
  const TemporaryFolder folder;
  recording::write_bag(folder.file("bag"), {{"/a", 0.0, 7}, {"/a", 0.01, 8}});
  FakeContext fake;
  fake.set_parameter("bag", folder.file("bag"));
  fake.set_parameter("rate", 100.0);
  fake.set_parameter("remap", std::vector<std::string>{"/a:=/b"});
  ReplayComponent replay(fake);
  replay.start();
  ASSERT_TRUE(run_until(fake, [&] { return logged(fake, "2 messages sent"); }));
  const auto messages = fake.published<RawMessage>("/a");
  ASSERT_EQ(messages.size(), 2U);
  EXPECT_EQ(messages[0]->cdr, recording::stamped_cdr(kStart_ns, 7));
}

TEST(ReplayComponent, WithoutItsBagARunThatWouldEndWithItEnds) {
  for (const bool exit_at_end : {false, true}) {
    FakeContext fake;
    fake.set_parameter("bag", std::string("/no/such/bag"));
    fake.set_parameter("exit_at_end", exit_at_end);
    ReplayComponent replay(fake);
    EXPECT_THAT([&] { replay.start(); },
                ::testing::ThrowsMessage<std::runtime_error>(::testing::HasSubstr("/no/such/bag")));
    EXPECT_EQ(fake.exit_requested(), exit_at_end);
  }
}

TEST(ReplayComponent, LockstepSendsTheNextFrameWhenTheLastIsDone) {
  const TemporaryFolder folder;
  recording::write_bag(
      folder.file("bag"),
      {{"/image", 0.0, 0}, {"/imu", 0.05, 1}, {"/image", 0.1, 2}, {"/imu", 0.15, 3}});
  FakeContext fake;
  fake.set_parameter("bag", folder.file("bag"));
  fake.set_parameter("lockstep", true);
  fake.set_parameter("lockstep_topic", std::string("/image"));
  fake.set_parameter("lockstep_components", std::vector<std::string>{"tracking"});
  fake.set_parameter("frames_in_flight", std::int64_t{1});
  ReplayComponent replay(fake);
  replay.start();
  ASSERT_TRUE(sent(fake, "2"));
  fake.send<Progress>("progress", [](Progress& progress) {
    progress.header().stamp_ns() = kStart_ns;
    std::strncpy(progress.component_name().data(), "tracking", progress.component_name().size());
  });
  ASSERT_TRUE(run_until(fake, [&] { return logged(fake, "4 messages sent"); }));
}

/// Sync stamps its reports in lidar time: 10 ms after these images by the driver, whose clock is 30
/// ms behind or 500 ms ahead.
class ReplayWithAnOffset : public ::testing::TestWithParam<std::int64_t> {};

TEST_P(ReplayWithAnOffset, LockstepFollowsReportsInLidarTime) {
  const TemporaryFolder folder;
  recording::write_bag(folder.file("bag"),
                       {{"/image", 0.0, 0}, {"/image", 0.1, 1}, {"/image", 0.2, 2}});
  FakeContext fake;
  fake.set_parameter("bag", folder.file("bag"));
  fake.set_parameter("lockstep", true);
  fake.set_parameter("lockstep_topic", std::string("/image"));
  fake.set_parameter("lockstep_components", std::vector<std::string>{"sync", "tracking"});
  fake.set_parameter("frames_in_flight", std::int64_t{1});
  fake.set_parameter("rig.camera_time_offset_ns", GetParam());
  ReplayComponent replay(fake);
  replay.start();
  ASSERT_TRUE(sent(fake, "1"));
  const std::int64_t half_readout_ns = 10'000'000;
  for (const std::int64_t number : {0, 1}) {
    const auto stamp_ns = kStart_ns + number * 100'000'000 + GetParam() + half_readout_ns;
    send_progress(fake, "sync", stamp_ns, 1 + number);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    fake.advance(std::chrono::milliseconds(200));
    EXPECT_EQ(fake.diagnostics().status().values["sent"], std::to_string(1 + number));
    send_progress(fake, "tracking", stamp_ns, 1 + number);
    ASSERT_TRUE(sent(fake, std::to_string(2 + number)));
  }
}

INSTANTIATE_TEST_SUITE_P(Clocks,
                         ReplayWithAnOffset,
                         ::testing::Values(-30'000'000, 0, 500'000'000));

/// Two images in lockstep, which sync and tracking report.
class ReplayOfTwoFrames : public ::testing::Test {
 protected:
  void start() {
    recording::write_bag(folder_.file("bag"), {{"/image", 0.0, 0}, {"/image", 0.1, 2}});
    fake_.set_parameter("bag", folder_.file("bag"));
    fake_.set_parameter("lockstep", true);
    fake_.set_parameter("lockstep_topic", std::string("/image"));
    fake_.set_parameter("lockstep_components", std::vector<std::string>{"sync", "tracking"});
    fake_.set_parameter("exit_at_end", true);
    replay_.emplace(fake_);
    replay_->start();
  }

  const TemporaryFolder folder_;
  FakeContext fake_;
  std::optional<ReplayComponent> replay_;
};

/// One at a time, and sync alone reports the first.
class ReplayThatIsHeld : public ReplayOfTwoFrames {
 protected:
  void SetUp() override {
    fake_.set_parameter("frames_in_flight", std::int64_t{1});
    start();
    ASSERT_TRUE(sent(fake_, "1"));
    send_progress(fake_, "sync", kStart_ns, 1);
  }
  void tell_state(const std::string& component, const std::string& state) {
    fake_.send<DiagnosticArray>("diagnostics", [&](DiagnosticArray& message) {
      auto& status = message.status().emplace_back();
      status.hardware_id("rig");
      status.name("rig: " + component);
      status.message("stopped after an error: bad frame");
      status.values().emplace_back();
      status.values().back().key("state");
      status.values().back().value(state);
    });
  }
};

TEST_F(ReplayThatIsHeld, GivesUpWhenNothingMovesAndNamesWhoIsMissing) {
  EXPECT_NO_THROW(fake_.advance(std::chrono::seconds(200))) << "a busy machine may take long";
  send_progress(fake_, "viewer", kStart_ns, 1);
  EXPECT_NO_THROW(fake_.advance(std::chrono::seconds(200))) << "somebody was still at work";
  EXPECT_FALSE(fake_.exit_requested());
  EXPECT_THAT([&] { fake_.advance(std::chrono::seconds(110)); },
              ::testing::ThrowsMessage<std::runtime_error>(::testing::AllOf(
                  ::testing::HasSubstr("tracking"), ::testing::Not(::testing::HasSubstr("sync")))));
  EXPECT_TRUE(fake_.exit_requested());
}

TEST_F(ReplayThatIsHeld, MayBePausedForLong) {
  ASSERT_TRUE(change(fake_, "paused", true).empty());
  EXPECT_NO_THROW(fake_.advance(std::chrono::seconds(3600)));
}

TEST_F(ReplayThatIsHeld, DoesNotWaitForAComponentThatHasStopped) {
  tell_state("viewer", "stopped");  // nobody waits for it
  tell_state("tracking", "running");
  EXPECT_NO_THROW(fake_.advance(std::chrono::seconds(10)));
  tell_state("tracking", "stopped");
  EXPECT_THAT([&] { fake_.advance(std::chrono::seconds(10)); },
              ::testing::ThrowsMessage<std::runtime_error>(
                  ::testing::HasSubstr("tracking (stopped after an error: bad frame)")));
  EXPECT_TRUE(fake_.exit_requested());
}

TEST(ReplayComponent, ARecordingThatCannotBeReadToTheEndIsAnError) {
  for (const bool exit_at_end : {true, false}) {
    const TemporaryFolder folder;
    recording::write_bag(folder.file("bag"), {{"/a", 0.0, 7}});
    recording::damage_bag(folder.file("bag"));
    FakeContext fake;
    fake.set_parameter("bag", folder.file("bag"));
    fake.set_parameter("exit_at_end", exit_at_end);
    ReplayComponent replay(fake);
    replay.start();
    EXPECT_THAT([&] { run_until(fake, [&] { return fake.exit_requested(); }); },
                ::testing::ThrowsMessage<std::runtime_error>(::testing::HasSubstr("CRC")));
    EXPECT_EQ(fake.exit_requested(), exit_at_end);
  }
}

TEST(ReplayComponent, AsksForTheExitOnceNothingIsReportedDoneAnyMore) {
  const TemporaryFolder folder;
  recording::write_bag(folder.file("bag"), {{"/a", 0.0, 7}});
  FakeContext fake;
  fake.set_parameter("bag", folder.file("bag"));
  fake.set_parameter("exit_at_end", true);
  fake.set_parameter("settle_s", 1.0);
  ReplayComponent replay(fake);
  replay.start();
  ASSERT_TRUE(run_until(fake, [&] { return logged(fake, "1 messages sent"); }));
  fake.advance(std::chrono::milliseconds(800));
  EXPECT_FALSE(fake.exit_requested());
  fake.send<Progress>("progress", [](Progress&) {});
  fake.advance(std::chrono::milliseconds(800));
  EXPECT_FALSE(fake.exit_requested()) << "somebody was still at work";
  fake.advance(std::chrono::milliseconds(400));
  EXPECT_TRUE(fake.exit_requested());
}

TEST(ReplayComponent, DoesNotAskForTheExitWhileAComponentHasWork) {
  const TemporaryFolder folder;
  recording::write_bag(folder.file("bag"), {{"/a", 0.0, 7}});
  FakeContext fake;
  fake.set_parameter("bag", folder.file("bag"));
  fake.set_parameter("exit_at_end", true);
  fake.set_parameter("settle_s", 0.0);
  fake.set_all_idle(false);
  ReplayComponent replay(fake);
  replay.start();
  ASSERT_TRUE(run_until(fake, [&] { return logged(fake, "1 messages sent"); }));
  fake.advance(std::chrono::minutes(10));
  EXPECT_FALSE(fake.exit_requested());
  fake.set_all_idle(true);
  fake.advance(std::chrono::milliseconds(200));
  EXPECT_TRUE(fake.exit_requested());
}

/// Both are sent.
class ReplayToTheEnd : public ReplayOfTwoFrames {
 protected:
  void SetUp() override {
    fake_.set_parameter("settle_s", 0.2);
    start();
    ASSERT_TRUE(run_until(fake_, [&] { return logged(fake_, "2 messages sent"); }));
  }
  void report(std::string_view component, std::uint64_t frame_id) {
    send_progress(fake_, component, kStart_ns + static_cast<std::int64_t>(frame_id), frame_id);
  }
};

/// A busy machine may take longer for the last frame than any time that one would wait.
TEST_F(ReplayToTheEnd, WaitsForTheLastFrameThatWasHandedOn) {
  report("sync", 1);
  report("tracking", 1);
  report("sync", 2);
  fake_.advance(std::chrono::seconds(100));
  EXPECT_FALSE(fake_.exit_requested());
  report("tracking", 2);
  fake_.advance(std::chrono::milliseconds(400));
  EXPECT_TRUE(fake_.exit_requested());
}

TEST_F(ReplayToTheEnd, DoesNotWaitForAFrameThatIsNeverWhole) {
  report("sync", 1);
  report("tracking", 1);
  fake_.advance(std::chrono::milliseconds(400));
  EXPECT_TRUE(fake_.exit_requested());
}

TEST_F(ReplayToTheEnd, GivesUpWhatNeverComesAndNamesWhoHasIt) {
  report("sync", 1);
  EXPECT_THAT([&] { fake_.advance(std::chrono::seconds(310)); },
              ::testing::ThrowsMessage<std::runtime_error>(::testing::HasSubstr("tracking")));
  EXPECT_TRUE(fake_.exit_requested());
}

TEST(ReplayComponent, PublishesTheClockOfTheRecording) {
  const TemporaryFolder folder;
  recording::write_bag(folder.file("bag"), {{"/a", 0.0, 7}});
  FakeContext fake;
  fake.set_parameter("bag", folder.file("bag"));
  fake.set_parameter("clock_hz", 10.0);
  ReplayComponent replay(fake);
  replay.start();
  fake.advance(std::chrono::milliseconds(100));
  const auto clocks = fake.published<rosgraph_msgs::msg::Clock>("clock");
  ASSERT_EQ(clocks.size(), 1U);
  EXPECT_GE(clocks[0]->clock().sec(), kStart_ns / recording::kSecond_ns);
}

TEST(ReplayComponent, PauseAndRateMayChangeWhileItPlays) {
  const TemporaryFolder folder;
  recording::write_bag(folder.file("bag"), {{"/a", 0.0, 7}, {"/a", 1000.0, 8}});
  FakeContext fake;
  fake.set_parameter("bag", folder.file("bag"));
  fake.set_parameter("paused", true);
  ReplayComponent replay(fake);
  EXPECT_TRUE(change(fake, "rate", 2.0).empty());  // before the start, too
  replay.start();
  EXPECT_TRUE(replay.player().state().paused);
  EXPECT_TRUE(change(fake, "paused", false).empty());
  ASSERT_TRUE(sent(fake, "1"));
  EXPECT_TRUE(change(fake, "rate", 1e6).empty());
  ASSERT_TRUE(run_until(fake, [&] { return logged(fake, "2 messages sent"); }));
  const auto problems = change(fake, "loop", true);
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_THAT(problems[0].message, ::testing::HasSubstr("fixed after start"));
  EXPECT_FALSE(change(fake, "rate", -1.0).empty());
}

TEST(ReplayComponent, LeavesOutARecordedClockWhenItMakesItsOwn) {
  const TemporaryFolder folder;
  recording::write_bag(folder.file("bag"), {{"/clock", 0.0, 7}, {"/a", 0.0, 8}});
  FakeContext fake;
  fake.set_parameter("bag", folder.file("bag"));
  fake.set_parameter("clock_hz", 10.0);
  ReplayComponent replay(fake);
  replay.start();
  ASSERT_TRUE(run_until(fake, [&] { return logged(fake, "1 messages sent"); }));
}

TEST(ReplayComponent, OverridesOfQosWin) {
  const TemporaryFolder folder;
  recording::write_bag(folder.file("bag"), {{"/a", 0.0, 7}, {"/b", 0.0, 8}});
  std::ofstream(folder.file("qos.yaml")) << "/b: {reliability: best_effort}\n";
  FakeContext fake;
  fake.set_parameter("bag", folder.file("bag"));
  fake.set_parameter("qos_overrides", folder.file("qos.yaml"));
  ReplayComponent replay(fake);
  replay.start();
  EXPECT_THAT(replay.best_effort_topics(), ::testing::ElementsAre("/b"));
}

TEST(ReplayComponent, WaitsForTheOtherSideOfTopics) {
  const TemporaryFolder folder;
  recording::write_bag(folder.file("bag"), {{"/a", 0.0, 7}});
  FakeContext fake;
  fake.set_parameter("bag", folder.file("bag"));
  fake.set_parameter("wait_for_topics", std::vector<std::string>{"/map"});
  fake.set_topics({{"/map", "type", {}, 1, 0}});
  ReplayComponent replay(fake);
  replay.start();
  fake.advance(std::chrono::seconds(2));
  EXPECT_TRUE(logged(fake, "waits for the other side of /map"));
  EXPECT_FALSE(fake.diagnostics().status().values.contains("sent"));
  fake.set_topics({{"/map", "type", {}, 1, 1}});
  EXPECT_TRUE(run_until(fake, [&] { return logged(fake, "1 messages sent"); }));
}

TEST(ReplayComponent, EndsAfterTheGivenDuration) {
  const TemporaryFolder folder;
  recording::write_bag(folder.file("bag"), {{"/a", 0.0, 7}, {"/a", 0.05, 8}, {"/a", 0.5, 9}});
  FakeContext fake;
  fake.set_parameter("bag", folder.file("bag"));
  fake.set_parameter("duration_s", 0.1);
  ReplayComponent replay(fake);
  replay.start();
  EXPECT_TRUE(run_until(fake, [&] { return logged(fake, "2 messages sent"); }));
}

TEST(ReplayComponent, MissingBagIsAClearError) {
  FakeContext fake;
  fake.set_parameter("bag", std::string("/no/such/bag"));
  ReplayComponent replay(fake);
  EXPECT_THAT([&] { replay.start(); },
              ::testing::ThrowsMessage<std::runtime_error>(::testing::HasSubstr("/no/such/bag")));
}

TEST(ReplayComponent, BadParametersAreAllReported) {
  FakeContext fake;
  fake.set_parameter("rate", 0.0);
  fake.set_parameter("frames_in_flight", std::int64_t{0});
  EXPECT_THAT([&] { ReplayComponent replay(fake); },
              ::testing::ThrowsMessage<config::ConfigError>(::testing::AllOf(
                  ::testing::HasSubstr("rate"), ::testing::HasSubstr("frames_in_flight"))));
}

}  // namespace
}  // namespace camvox
