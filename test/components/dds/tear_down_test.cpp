#include <gmock/gmock.h>

#include <atomic>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/test/deadline.hpp"
#include "camvox/test/test_container.hpp"

// Fast DDS aborts the process when something is still on loan at the wrong moment. Each test here
// passes by being alive at its end.
namespace camvox {
namespace {

using camvox_interfaces::msg::Cloud;
using std::chrono_literals::operator""ms;
using test::wait_until;
using ::testing::IsEmpty;

constexpr Port kPort{"cloud", topics::kCloud};

TEST(TearDown, WithSamplesHeldAndLoansOut) {
  std::mutex mutex;
  std::deque<Sample<Cloud>> held;
  std::optional<Loan<Cloud>> loan;
  Publisher<Cloud> publisher;
  Subscription subscription;
  {
    test::TestContainer container;
    auto& context = container.component();
    publisher = context.advertise<Cloud>(kPort);
    subscription = context.subscribe<Cloud>(kPort, [&](const Sample<Cloud>& cloud) {
      const std::lock_guard lock(mutex);
      held.push_back(cloud);
    });
    container.activate();
    for (std::uint64_t frame = 1; frame <= 2; ++frame) {
      auto cloud = publisher.loan();
      cloud->header().frame_id(frame);
      publisher.publish(std::move(cloud));
    }
    ASSERT_TRUE(wait_until([&] {
      const std::lock_guard lock(mutex);
      return held.size() == 2;
    }));
    loan = publisher.loan();
  }
  EXPECT_EQ(held.at(1)->header().frame_id(), 2U) << "what is held stays readable";
  (*loan)->header().frame_id(3);
  publisher.publish(std::move(*loan));
}

TEST(TearDown, InEveryOrderOfReleases) {
  for (int order = 0; order < 4; ++order) {
    std::atomic<bool> got = false;
    std::optional<Sample<Cloud>> held;
    std::optional<Loan<Cloud>> loan;
    auto container = std::make_unique<test::TestContainer>();
    auto& context = container->component();
    auto publisher = context.advertise<Cloud>(kPort);
    context.subscribe<Cloud>(kPort, [&](const Sample<Cloud>& cloud) {
      if (!got) held = cloud;
      got = true;
    });
    container->activate();
    publisher.publish(publisher.loan());
    ASSERT_TRUE(wait_until([&] { return got.load(); }));
    loan = publisher.loan();
    if ((order & 1) != 0) held.reset();
    if ((order & 2) != 0) container.reset();
    loan.reset();
    publisher = {};
    container.reset();
    held.reset();
  }
}

TEST(TearDown, WriterGoesBeforeItsReaders) {
  std::mutex mutex;
  std::deque<Sample<Cloud>> held;
  test::TestContainer container;
  auto& writer = container.component("writer");
  container.component("reader").subscribe<Cloud>(kPort, [&](const Sample<Cloud>& cloud) {
    const std::lock_guard lock(mutex);
    held.push_back(cloud);
  });
  {
    auto publisher = writer.advertise<Cloud>(kPort);
    container.activate();
    for (int i = 0; i < 3; ++i) publisher.publish(publisher.loan());
    ASSERT_TRUE(wait_until([&] {
      const std::lock_guard lock(mutex);
      return held.size() >= 2;
    }));
  }
  container.remove(writer);
  const std::lock_guard lock(mutex);
  for (const auto& cloud : held) EXPECT_EQ(cloud->points_count(), 0U);
}

TEST(TearDown, ReadersComeAndGoUnderAFastWriter) {
  std::atomic<bool> stop = false;
  std::atomic<std::uint64_t> received = 0;
  test::TestContainer container;
  auto publisher = container.component("writer").advertise<Cloud>(kPort, {.qos = qos::kFrames});
  container.activate();
  std::jthread writer([&] {
    while (!stop) {
      try {
        publisher.publish(publisher.loan());
      } catch (const LoanError&) {  // a reader that leaves may hold the pool for a moment
      }
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
  });
  for (int i = 0; i < 60; ++i) {
    auto& reader = container.component("reader");
    const auto before = received.load();
    reader.subscribe<Cloud>(kPort, [&](const Sample<Cloud>&) { ++received; });
    container.activate();
    EXPECT_TRUE(wait_until([&] { return received > before; })) << "reader " << i;
    container.remove(reader);
  }
  stop = true;
  writer.join();
  EXPECT_THAT(container.errors(), IsEmpty());
}

TEST(TearDown, SamplesReturnOnOtherThreads) {
  std::mutex mutex;
  std::deque<Sample<Cloud>> held;
  std::atomic<std::uint64_t> last = 0;
  std::atomic<bool> stop = false;
  test::TestContainer container;
  auto publisher = container.component("writer").advertise<Cloud>(kPort, {.qos = qos::kFrames});
  container.component("reader").subscribe<Cloud>(kPort,
                                                 [&](const Sample<Cloud>& cloud) {
                                                   const std::lock_guard lock(mutex);
                                                   if (held.size() < 4) held.push_back(cloud);
                                                   last = cloud->header().frame_id();
                                                 },
                                                 {.qos = qos::kFrames, .max_held = 4});
  container.activate();
  std::jthread releaser([&] {
    while (!stop) {
      const std::lock_guard lock(mutex);
      if (held.size() > 1) held.erase(held.begin() + static_cast<long>(held.size() / 2));
    }
  });
  constexpr std::uint64_t kSent = 500;
  for (std::uint64_t frame = 1; frame <= kSent; ++frame) {
    auto cloud = publisher.loan();
    cloud->header().frame_id(frame);
    publisher.publish(std::move(cloud));
  }
  EXPECT_TRUE(wait_until([&] { return last == kSent; }));
  stop = true;
}

}  // namespace
}  // namespace camvox
