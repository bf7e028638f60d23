#include "camvox/dds/executor.hpp"

#include <gmock/gmock.h>

#include <fastdds/dds/core/condition/GuardCondition.hpp>
#include <thread>
#include <vector>

#include "camvox/test/deadline.hpp"

namespace camvox::dds {
namespace {

using namespace std::chrono_literals;
using eprosima::fastdds::dds::GuardCondition;
using test::wait_until;

std::shared_ptr<Tenant> tenant(std::atomic<int>* errors = nullptr) {
  return std::make_shared<Tenant>("tenant", [errors](std::exception_ptr) {
    if (errors != nullptr) ++*errors;
  });
}

TEST(Executor, RunsPostedWorkInOrderOnOneThread) {
  Executor executor("test");
  const auto self = tenant();
  std::vector<int> order;
  std::atomic<bool> done = false;
  for (int i = 0; i < 100; ++i) executor.post(self, [&order, i] { order.push_back(i); });
  executor.post(self, [&done] { done = true; });
  executor.start();
  ASSERT_TRUE(wait_until([&] { return done.load(); }));
  ASSERT_EQ(order.size(), 100U);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

TEST(Executor, TimersRepeat) {
  Executor executor("test");
  std::atomic<int> fired = 0;
  executor.every(tenant(), 1ms, [&fired] { ++fired; });
  executor.start();
  EXPECT_TRUE(wait_until([&] { return fired >= 5; }));
}

TEST(Executor, AThrowingCallbackDoesNotHoldUpWhatWaitsBehindIt) {
  constexpr int kItems = 50;
  GuardCondition arrived;
  std::atomic<int> waiting = kItems;
  std::atomic<int> errors = 0;
  Executor executor("test");
  const auto self = tenant(&errors);
  executor.add_source(self, &arrived, [&waiting]() -> bool {
    if (waiting == 0) return false;
    --waiting;
    throw std::runtime_error("bad message");
  });
  executor.start();
  // One look a second would take longer than the patience of wait_until.
  EXPECT_TRUE(wait_until([&] { return waiting == 0; }));
  EXPECT_TRUE(wait_until([&] { return errors == kItems; }));
  EXPECT_TRUE(executor.remove(self, 5s));
}

TEST(Executor, WakerMakesItLookAgain) {
  GuardCondition never;
  std::atomic<int> looks = 0;
  Executor executor("test");
  const auto self = tenant();
  executor.add_source(self, &never, [&looks] {
    ++looks;
    return false;
  });
  executor.start();
  const auto wake = executor.waker();
  for (int i = 0; i < 50; ++i) {
    const int before = looks;
    wake();
    ASSERT_TRUE(wait_until([&] { return looks > before; }));
  }
  EXPECT_TRUE(executor.remove(self, 5s));
}

TEST(Executor, WakerOfAnExecutorThatIsGoneDoesNothing) {
  std::function<void()> wake;
  {
    Executor executor("test");
    wake = executor.waker();
  }
  wake();
}

TEST(Executor, NothingOfARemovedTenantRuns) {
  Executor executor("test");
  const auto leaving = tenant();
  const auto staying = tenant();
  std::atomic<int> ran = 0;
  std::atomic<int> still = 0;
  executor.every(leaving, 1ms, [&ran] { ++ran; });
  executor.every(staying, 1ms, [&still] { ++still; });
  executor.start();
  ASSERT_TRUE(wait_until([&] { return ran > 3; }));
  ASSERT_TRUE(executor.remove(leaving, 5s));
  const int at_removal = ran;
  const int others = still;
  ASSERT_TRUE(wait_until([&] { return still > others + 5; }));
  EXPECT_EQ(ran, at_removal);
  executor.post(leaving, [&ran] { ++ran; });
  ASSERT_TRUE(wait_until([&] { return still > others + 10; }));
  EXPECT_EQ(ran, at_removal);
}

TEST(Executor, TellsHowLongACallbackHasRunAndThatItHangs) {
  Executor executor("test");
  const auto self = tenant();
  std::atomic<bool> release = false;
  executor.post(self, [&release] {
    while (!release) std::this_thread::sleep_for(1ms);
  });
  executor.start();
  EXPECT_TRUE(wait_until([&] { return self->busy_time() > 20ms; }));
  EXPECT_FALSE(executor.remove(self, 10ms));
  EXPECT_FALSE(executor.stop(10ms));
  release = true;
  EXPECT_TRUE(executor.stop(10s));
  EXPECT_EQ(self->busy_time().count(), 0);
}

TEST(Executor, IsIdleWhenNothingIsLeftToDo) {
  GuardCondition arrived;
  std::atomic<bool> goes_on = false;
  Executor executor("test");
  EXPECT_FALSE(executor.idle()) << "not even started";
  executor.start();
  EXPECT_TRUE(wait_until([&] { return executor.idle(); }));
  executor.post(tenant(), [&goes_on] {
    while (!goes_on) std::this_thread::sleep_for(1ms);
  });
  EXPECT_FALSE(executor.idle()) << "has work, begun or not";
  goes_on = true;
  EXPECT_TRUE(wait_until([&] { return executor.idle(); }));
  const auto self = tenant();
  executor.add_source(self, &arrived, [] { return false; });
  arrived.set_trigger_value(true);
  EXPECT_FALSE(executor.idle()) << "a message waits";
  arrived.set_trigger_value(false);
  EXPECT_TRUE(wait_until([&] { return executor.idle(); }));
  EXPECT_TRUE(executor.remove(self, 5s));
}

TEST(Executor, AsksItselfWithoutCountingWhatAsks) {
  Executor executor("test");
  std::atomic<int> idle = -1;
  std::atomic<int> with_more_to_do = -1;
  executor.post(tenant(), [&] { with_more_to_do = executor.idle() ? 1 : 0; });
  executor.post(tenant(), [&] { idle = executor.idle() ? 1 : 0; });
  executor.start();
  ASSERT_TRUE(wait_until([&] { return idle != -1; }));
  EXPECT_EQ(with_more_to_do, 0);
  EXPECT_EQ(idle, 1);
}

/// One piece of work goes from thread to thread: at each moment one of them has it.
TEST(Executor, WorkThatIsHandedOnIsNeverOverlooked) {
  constexpr int kHops = 20'000;
  std::vector<std::shared_ptr<Executor>> executors;
  for (const auto* name : {"a", "b", "c"}) executors.push_back(std::make_shared<Executor>(name));
  const auto self = tenant();
  std::atomic<int> hops = 0;
  std::function<void()> hop = [&] {
    const int done = ++hops;
    if (done < kHops) executors[static_cast<std::size_t>(done) % 3]->post(self, hop);
  };
  executors[0]->post(self, hop);
  for (const auto& executor : executors) executor->start();
  while (!all_idle(executors)) std::this_thread::yield();  // ask often: the gaps are short
  EXPECT_EQ(hops, kHops);
}

}  // namespace
}  // namespace camvox::dds
