#include <gmock/gmock.h>

#include <atomic>
#include <string>

#include "camvox/test/test_container.hpp"

namespace camvox {
namespace {

using std::chrono_literals::operator""ms;

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

}  // namespace
}  // namespace camvox
