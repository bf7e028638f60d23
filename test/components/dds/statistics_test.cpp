#include <gmock/gmock.h>

#include <atomic>
#include <cstring>
#include <string>

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/test/deadline.hpp"
#include "camvox/test/test_container.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::DepthImage;
using std::chrono_literals::operator""ms;
using test::wait_until;

// The container asks for them while a component, like record, makes one subscription after the
// other on its own thread.
TEST(Statistics, CanBeReadWhileSubscriptionsAreMade) {
  constexpr int kTopics = 40;
  std::atomic<int> made = 0;
  test::TestContainer container;
  auto& recorder = container.component("recorder");
  recorder.every(2ms, [&] {
    if (made == kTopics) return;
    const std::string topic = "/topic" + std::to_string(made);
    recorder.subscribe_raw({topic, topic}, "std_msgs/msg/Header", [](const auto&) {});
    ++made;
  });
  container.activate();
  int wrong = 0;
  while (made < kTopics) {
    for (const auto& port : recorder.subscription_stats()) {
      wrong += port.topic.starts_with("/topic") && port.stats.received == 0 ? 0 : 1;
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(recorder.subscription_stats().size(), std::size_t{kTopics});
}

// What the gateway cannot serialise as fast as it comes no process outside sees; sequence numbers
// on the wire do not tell.
TEST(Statistics, CountWhatIsLostOnTheWayOut) {
  constexpr std::uint64_t kSent = 300;
  std::atomic<std::uint64_t> recorded = 0, newest = 0;
  test::TestContainer container;
  auto& source = container.component("source");
  auto& recorder = container.component("recorder");
  auto images = source.advertise<DepthImage>({"depth", "/depth"}, {.qos = qos::kFrames});
  const auto reader = recorder.subscribe_raw({"depth", "/depth"},
                                             "camvox_interfaces/msg/DepthImage",
                                             [&](const auto& bytes) {
                                               // After 4 bytes encapsulation and the stamp.
                                               std::uint64_t id = 0;
                                               std::memcpy(&id, bytes->cdr.data() + 12, sizeof(id));
                                               newest = id;
                                               ++recorded;
                                             },
                                             {.qos = {400, true, false}});
  container.activate();
  const auto send = [&](std::uint64_t id) {
    auto image = images.loan();
    image->header().frame_id(id);
    image->depth_m_count(640 * 480);
    image->sigma_m_count(640 * 480);
    images.publish(std::move(image));
  };
  ASSERT_TRUE(wait_until([&] { return images.subscriber_count() > 0; })) << "the gateway's";
  send(1);
  ASSERT_TRUE(wait_until([&] { return newest == 1; }));
  for (std::uint64_t id = 2; id <= kSent; ++id) send(id);
  ASSERT_TRUE(wait_until([&] { return newest == kSent; })) << "the newest always arrives";
  EXPECT_LT(recorded, kSent) << "a burst that is no burst tests nothing";
  EXPECT_EQ(recorded + reader->stats().lost, kSent);
  ASSERT_EQ(source.unsent().size(), 1U);
  EXPECT_EQ(source.unsent()[0].topic, "/depth");
  EXPECT_GT(source.unsent()[0].messages, 0U);
  EXPECT_LE(source.unsent()[0].messages, reader->stats().lost) << "which may lose more by itself";
}

}  // namespace
}  // namespace camvox
