#include <atomic>
#include <chrono>
#include <thread>

#include "camvox/dds/component_context.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/diagnostic_msgs.hpp"
#include "camvox/interfaces/header.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/test/test_container.hpp"
#include "container_fixture.hpp"

namespace camvox::bringup {
namespace {

using namespace std::chrono_literals;
using diagnostic_msgs::msg::DiagnosticArray;
using test::wait_until;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

using ContainerTest = ContainerFixture;

/// Looks at /diagnostics of the domain from a participant of its own.
class DiagnosticsReader {
 public:
  DiagnosticsReader() : executor_(std::make_shared<dds::Executor>("diagnostics")) {
    dds::ParticipantOptions options;
    options.domain_id = test::own_domain();
    dds::Middleware middleware;
    middleware.participant = dds::Participant::create(options, *log_);
    context_ = std::make_unique<dds::ComponentContext>(
        dds::ComponentSettings{"reader", {}, {}}, middleware, executor_, log_, [](auto) {});
    context_->subscribe<DiagnosticArray>({"diagnostics", "/diagnostics"},
                                         [this](const Sample<DiagnosticArray>& message) {
                                           const std::lock_guard lock(mutex_);
                                           for (const auto& status : message->status()) {
                                             statuses_[status.name()] = status;
                                           }
                                         });
    executor_->start();
    context_->activate();
  }
  ~DiagnosticsReader() {
    context_->deactivate(1s);
    executor_->stop(1s);
  }

  [[nodiscard]] diagnostic_msgs::msg::DiagnosticStatus status(const std::string& name) {
    const std::lock_guard lock(mutex_);
    return statuses_[name];
  }
  [[nodiscard]] std::string value(const std::string& name, const std::string& key) {
    const auto current = status(name);
    for (const auto& pair : current.values()) {
      if (pair.key() == key) return pair.value();
    }
    return {};
  }

 private:
  std::shared_ptr<Logger> log_ = std::make_shared<ConsoleLogger>("test", LogLevel::kWarn);
  std::shared_ptr<dds::Executor> executor_;
  std::unique_ptr<dds::ComponentContext> context_;
  std::mutex mutex_;
  std::map<std::string, diagnostic_msgs::msg::DiagnosticStatus> statuses_;
};

TEST_F(ContainerTest, RunsAndReportsHealthOfEveryComponent) {
  start(
      "container: {name: rig, diagnostics_period_s: 0.05}\n"
      "components:\n  - {plugin: test::Ticker, name: a}\n  - {plugin: test::Ticker, name: b}\n");
  DiagnosticsReader diagnostics;
  ASSERT_TRUE(wait_until([&] { return diagnostics.value("rig: b", "ticks") != ""; }));
  EXPECT_EQ(diagnostics.status("rig: a").level(), 0);
  EXPECT_EQ(diagnostics.status("rig: a").hardware_id(), "rig");
  EXPECT_EQ(diagnostics.value("rig: a", "errors"), "0");
  EXPECT_EQ(component("a").id, 1U);
  EXPECT_EQ(component("b").id, 2U);
}

TEST_F(ContainerTest, StopEndsOnlyTheComponentThatThrows) {
  start(
      "container: {name: rig, diagnostics_period_s: 0.05}\ncomponents:\n"
      "  - {plugin: test::Ticker, name: bad, on_error: stop, parameters: {fail_at: 3}}\n"
      "  - {plugin: test::Ticker, name: good}\n");
  ASSERT_TRUE(wait_until([&] { return component("bad").state == ComponentState::kStopped; }));
  EXPECT_EQ(component("bad").errors, 1U);
  EXPECT_EQ(component("bad").last_error, "tick failed");
  EXPECT_EQ(component("good").state, ComponentState::kRunning);
  EXPECT_TRUE(log_.has("error bad: stops after an error: tick failed"));
  DiagnosticsReader diagnostics;
  ASSERT_TRUE(wait_until([&] { return diagnostics.status("rig: bad").level() == 2; }));
  EXPECT_EQ(diagnostics.status("rig: bad").message(), "stopped after an error: tick failed");
  const auto before = diagnostics.value("rig: good", "ticks");
  EXPECT_TRUE(wait_until([&] { return diagnostics.value("rig: good", "ticks") != before; }));
}

TEST_F(ContainerTest, RestartBuildsTheComponentAnewWithGrowingPauses) {
  start(
      "components:\n"
      "  - {plugin: test::Ticker, name: bad, on_error: restart, parameters: {fail_at: 1}}\n");
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(wait_until([&] { return component("bad").restarts >= 3; }));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 650ms) << "0.1 + 0.2 + 0.4 s, less one poll";
  EXPECT_GE(component("bad").errors, 3U);
}

TEST_F(ContainerTest, WhatAComponentLeavesIsThereAfterItsRestart) {
  start(
      "components:\n"
      "  - {plugin: test::Ticker, name: bad, on_error: restart, parameters: {fail_at: 3}}\n");
  ASSERT_TRUE(wait_until([&] { return component("bad").restarts >= 2; }));
  EXPECT_TRUE(log_.has("info bad: 3 ticks before the error"));
}

TEST_F(ContainerTest, IgnoreKeepsTheComponentGoing) {
  start(
      "container: {name: rig, diagnostics_period_s: 0.05}\ncomponents:\n"
      "  - {plugin: test::Ticker, name: bad, on_error: ignore, parameters: {fail_at: 2}}\n");
  ASSERT_TRUE(wait_until([&] { return component("bad").errors == 1; }));
  DiagnosticsReader diagnostics;
  ASSERT_TRUE(wait_until([&] {
    const auto ticks = diagnostics.value("rig: bad", "ticks");
    return !ticks.empty() && std::stoi(ticks) > 4;
  }));
  EXPECT_EQ(component("bad").state, ComponentState::kRunning);
  EXPECT_EQ(diagnostics.value("rig: bad", "errors"), "1");
}

TEST_F(ContainerTest, ExceptionsThatAreNoStdExceptionDoNoMoreHarm) {
  start(
      "components:\n"
      "  - {plugin: test::Ticker, name: bad, parameters: {fail_at: 1, fault: int}}\n");
  ASSERT_TRUE(wait_until([&] { return component("bad").state == ComponentState::kStopped; }));
  EXPECT_THAT(component("bad").last_error, HasSubstr("not derived from std::exception"));
}

TEST_F(ContainerTest, ExceptionInStartIsHandledLikeAnyOther) {
  start(
      "components:\n"
      "  - {plugin: test::Ticker, name: bad, parameters: {fail_in_start: true}}\n");
  ASSERT_TRUE(wait_until([&] { return component("bad").state == ComponentState::kStopped; }));
  EXPECT_EQ(component("bad").last_error, "cannot start");
}

TEST_F(ContainerTest, WatchdogReportsAHangingCallbackOnceAndItsReturn) {
  start(
      "container: {name: rig, diagnostics_period_s: 0.05}\ncomponents:\n"
      "  - {plugin: test::Ticker, name: slow, watchdog_s: 0.2, parameters: {hang_s: 0.6}}\n");
  DiagnosticsReader diagnostics;
  ASSERT_TRUE(wait_until([&] { return component("slow").overdue; }));
  ASSERT_TRUE(wait_until([&] { return diagnostics.status("rig: slow").level() == 2; }));
  EXPECT_THAT(diagnostics.status("rig: slow").message(), HasSubstr("has been running for"));
  ASSERT_TRUE(wait_until([&] { return log_.has("warn slow: the overdue callback has returned"); }));
  EXPECT_GE(log_.count("error slow: a callback has been running for"), 1);
  EXPECT_LE(log_.count("error slow: a callback has been running for"),
            log_.count("warn slow: the overdue callback has returned") + 1)
      << "once per incident";
}

TEST_F(ContainerTest, StopsQuickly) {
  std::string text = "components:\n";
  for (int i = 0; i < 8; ++i) text += fmt::format("  - {{plugin: test::Ticker, name: t{}}}\n", i);
  start(text);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THAT(container_->stop(), IsEmpty());
  const auto took = std::chrono::steady_clock::now() - begin;
  RecordProperty("stop_ms", static_cast<int>(took / 1ms));
  EXPECT_LT(took, 2s);
}

TEST_F(ContainerTest, ComponentsOnOneExecutorShareItsThread) {
  start(
      "components:\n"
      "  - {plugin: test::Ticker, name: a, executor: shared, parameters: {hang_s: 0.5}}\n"
      "  - {plugin: test::Ticker, name: b, executor: shared}\n");
  EXPECT_EQ(component("a").state, ComponentState::kRunning);
  EXPECT_EQ(component("b").state, ComponentState::kRunning);
  EXPECT_THAT(container_->stop(), IsEmpty());
}

TEST_F(ContainerTest, LoadsAndUnloadsWhileRunning) {
  start("components: []\n");
  ComponentConfig config;
  config.plugin = "test::Ticker";
  config.name = "late";
  const auto info = container_->load(config);
  EXPECT_EQ(info.id, 1U);
  EXPECT_EQ(component("late").state, ComponentState::kRunning);
  EXPECT_THROW((void)container_->load(config), std::runtime_error) << "the name is taken";
  container_->unload(info.id);
  EXPECT_THAT(container_->components(), IsEmpty());
  EXPECT_THROW(container_->unload(info.id), std::runtime_error);
  EXPECT_EQ(container_->load(config).id, 2U) << "ids are not used twice";
}

// Frame ids are what tracking and depth tell new frames from old ones by.
TEST_F(ContainerTest, FrameIdsOfSyncGoOnAfterItWasMadeAnew) {
  start(
      "components:\n  - {plugin: camvox::SyncComponent, name: sync, parameters: {\n"
      "       camera.width_px: 64, camera.height_px: 48, use_imu: false}}\n");
  test::TestContainer outside;
  auto& rig = outside.component("rig");
  auto images = rig.advertise<sensor_msgs::msg::Image>({"image", topics::kImage});
  std::atomic<std::uint64_t> newest = 0;
  rig.subscribe<camvox_interfaces::msg::FrameImage>(
      {"frame_image", topics::kFrameImage},
      [&](const auto& frame) { newest = frame->header().frame_id(); },
      {.qos = qos::kFrames});
  std::int64_t stamp_ns = 1'700'000'000'000'000'000;
  const auto frames_come = [&] {
    auto image = images.loan();
    image->header(interfaces::to_header(stamp_ns += 100'000'000, "camera"));
    image->width(64);
    image->height(48);
    image->step(64);
    image->encoding("mono8");
    image->data().assign(64 * 48, 100);
    images.publish(std::move(image));
    std::this_thread::sleep_for(20ms);
    return newest > 0;
  };
  outside.activate();
  ASSERT_TRUE(wait_until(frames_come));
  EXPECT_LT(newest, 10'000U) << "ids of a first run count from 1";
  const std::uint64_t before = newest.exchange(0);
  ComponentConfig config;
  config.plugin = "camvox::SyncComponent";
  config.name = "sync";
  config.parameters["camera.width_px"] = {std::int64_t{64}, {}};
  config.parameters["camera.height_px"] = {std::int64_t{48}, {}};
  container_->unload(component("sync").id);
  newest = 0;
  (void)container_->load(config);
  ASSERT_TRUE(wait_until(frames_come));
  EXPECT_GT(newest, before + 1000) << "not what came of the first run";
}

TEST_F(ContainerTest, LoadRefusesASecondPublisherOfAnInternalTopic) {
  start("components:\n  - {plugin: test::PoseSource, name: source}\n");
  ComponentConfig config;
  config.plugin = "test::PoseSource";
  config.name = "second";
  try {
    (void)container_->load(config);
    FAIL() << "loaded";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("published by 'source' already"));
  }
}

}  // namespace
}  // namespace camvox::bringup
