#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <future>
#include <mutex>
#include <thread>
#include <vector>

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/test/deadline.hpp"
#include "camvox/test/test_container.hpp"
#include "dds_child.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Cloud;
using std::chrono_literals::operator""ms;
using test::wait_until;
using ::testing::IsEmpty;

constexpr Port kPort{"cloud", topics::kCloud};
constexpr std::uint32_t kPoints = 20'000;

void publish(Publisher<Cloud>& publisher, std::uint64_t frame) {
  auto cloud = publisher.loan();
  cloud->header().frame_id(frame);
  cloud->points_count() = kPoints;
  for (std::uint32_t i = 0; i < kPoints; ++i) cloud->points()[i].fill(static_cast<float>(frame));
  publisher.publish(std::move(cloud));
}

/// True if every point is of the message's own frame.
bool whole(const Cloud& cloud) {
  const auto expected = static_cast<float>(cloud.header().frame_id());
  for (std::uint32_t i = 0; i < cloud.points_count(); ++i) {
    for (const float value : cloud.points()[i]) {
      if (value != expected) return false;
    }
  }
  return cloud.points_count() == kPoints;
}

TEST(SlowReader, SeesWholeMessagesAndCountsWhatItMissed) {
  constexpr std::uint64_t kSent = 300;
  std::atomic<std::uint64_t> last = 0;
  std::atomic<int> torn = 0;
  std::atomic<int> out_of_order = 0;
  test::TestContainer container;
  auto publisher = container.component("writer").advertise<Cloud>(kPort, {.qos = qos::kFrames});
  const auto subscription = container.component("slow").subscribe<Cloud>(
      kPort,
      [&](const Sample<Cloud>& cloud) {
        torn += whole(*cloud) ? 0 : 1;
        std::this_thread::sleep_for(2ms);  // the writer laps us meanwhile
        torn += whole(*cloud) ? 0 : 1;
        out_of_order += cloud->header().frame_id() <= last ? 1 : 0;
        last = cloud->header().frame_id();
      },
      {.qos = qos::kFrames});
  container.activate();
  // What a reader misses before its first message cannot be told from what it was too late for.
  publish(publisher, 1);
  ASSERT_TRUE(wait_until([&] { return last == 1; }));
  for (std::uint64_t frame = 2; frame <= kSent; ++frame) publish(publisher, frame);
  ASSERT_TRUE(wait_until([&] { return last == kSent; })) << "the newest message always arrives";
  const auto stats = subscription->stats();
  EXPECT_EQ(torn, 0);
  EXPECT_EQ(out_of_order, 0);
  EXPECT_GT(stats.lost, 0U);
  EXPECT_EQ(stats.received + stats.lost, kSent);
}

TEST(SlowReader, StuckInItsCallbackHoldsUpNeitherWriterNorOthers) {
  constexpr int kSent = 60;
  std::promise<void> release;
  std::atomic<int> others = 0;
  dds::TopicSettings settings;
  settings.max_blocking = std::chrono::seconds(5);
  test::TestContainer container(test::test_options(), {{std::string(topics::kCloud), settings}});
  auto publisher = container.component("writer").advertise<Cloud>(kPort, {.qos = qos::kFrames});
  container.component("stuck").subscribe<Cloud>(
      kPort, [stuck = release.get_future().share()](const Sample<Cloud>&) { stuck.wait(); });
  container.component("free").subscribe<Cloud>(kPort, [&](const Sample<Cloud>&) { ++others; });
  container.activate();
  std::vector<std::chrono::nanoseconds> took;
  for (int i = 1; i <= kSent; ++i) {
    const auto start = std::chrono::steady_clock::now();
    publish(publisher, static_cast<std::uint64_t>(i));
    took.push_back(std::chrono::steady_clock::now() - start);
    ASSERT_TRUE(wait_until([&] { return others == i; }));
  }
  // A writer that waits for the stuck reader does so in each publish once its queue is full: for
  // max_blocking, or for the 100 ms that are DDS's default. Other jobs of the machine hold up some
  // publishes, not half of them.
  std::ranges::nth_element(took, took.begin() + kSent / 2);
  EXPECT_LT(took[kSent / 2], 50ms) << "publishing waits for the stuck reader";
  release.set_value();
}

TEST(SlowReader, HoldingTooMuchStopsDeliveryUntilItLetsGo) {
  std::uint64_t sent = 0;
  std::mutex mutex;
  std::deque<Sample<Cloud>> kept;
  bool keep = true;
  std::atomic<std::uint64_t> last = 0;
  test::TestContainer container;
  auto publisher = container.component("writer").advertise<Cloud>(kPort, {.qos = qos::kFrames});
  const auto subscription =
      container.component("hoarder").subscribe<Cloud>(kPort,
                                                      [&](const Sample<Cloud>& cloud) {
                                                        const std::lock_guard lock(mutex);
                                                        if (keep) kept.push_back(cloud);
                                                        last = cloud->header().frame_id();
                                                      },
                                                      {.qos = qos::kFrames, .max_held = 2});
  container.activate();
  ASSERT_TRUE(wait_until([&] {
    publish(publisher, ++sent);
    return subscription->stats().starved > 0;
  }));
  EXPECT_LT(last, sent);
  {
    const std::lock_guard lock(mutex);
    for (const auto& cloud : kept) EXPECT_TRUE(whole(*cloud)) << "what is held is not overwritten";
    keep = false;
    kept.clear();
  }
  EXPECT_TRUE(wait_until([&] { return last == sent; }, std::chrono::seconds(10)))
      << "the newest one waits to be delivered; last " << last << ", received "
      << subscription->stats().received << ", starved " << subscription->stats().starved;
}

TEST(SlowReader, ThatLetsGoGetsTheNextSampleAtOnce) {
  constexpr int kRounds = 50;  // a look once a second would take longer than wait_until waits
  std::mutex mutex;
  std::vector<Sample<Cloud>> kept;
  test::TestContainer container;
  auto publisher = container.component("writer").advertise<Cloud>(kPort, {.qos = qos::kFrames});
  const auto subscription =
      container.component("hoarder").subscribe<Cloud>(kPort,
                                                      [&](const Sample<Cloud>& cloud) {
                                                        const std::lock_guard lock(mutex);
                                                        kept.push_back(cloud);
                                                      },
                                                      {.qos = qos::kFrames, .max_held = 2});
  container.activate();
  const auto start = std::chrono::steady_clock::now();
  std::uint64_t sent = 0;
  for (int round = 0; round < kRounds; ++round) {
    const auto starved = subscription->stats().starved;
    ASSERT_TRUE(wait_until([&] {
      publish(publisher, ++sent);
      return subscription->stats().starved > starved;
    }));
    const auto received = subscription->stats().received;
    std::vector<Sample<Cloud>> released;
    {
      const std::lock_guard lock(mutex);
      released.swap(kept);
    }
    released.clear();
    ASSERT_TRUE(wait_until([&] { return subscription->stats().received > received; }));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(30));
}

TEST(SlowReader, InAnotherProcessIsWaitedForNoLongerThanTheBound) {
  constexpr int kSent = 30;
  dds::TopicSettings settings;
  settings.interprocess_zero_copy = true;
  settings.max_blocking = 20ms;
  test::TestContainer container(test::test_options(), {{std::string(topics::kCloud), settings}});
  auto publisher = container.component().advertise<Cloud>(kPort, {.qos = qos::kFrames});
  container.activate();
  auto child = test::start_child("shared", "stall");
  ASSERT_TRUE(child.wrote("matched")) << child.output();
  ASSERT_TRUE(wait_until([&] { return publisher.subscriber_count() > 0; }));
  const auto start = std::chrono::steady_clock::now();
  for (int i = 1; i <= kSent; ++i) publish(publisher, static_cast<std::uint64_t>(i));
  // Without the bound the first publish after the queue is full would never return.
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  EXPECT_TRUE(child.wrote("stalled")) << child.output();
}

}  // namespace
}  // namespace camvox
