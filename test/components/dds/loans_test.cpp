#include <gmock/gmock.h>

#include <atomic>
#include <optional>

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/test/deadline.hpp"
#include "camvox/test/test_container.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Cloud;
using sensor_msgs::msg::Imu;
using test::wait_until;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr Port kPort{"cloud", topics::kCloud};

TEST(Loans, AreLimitedAndComeBack) {
  std::atomic<std::uint64_t> last = 0;
  test::TestContainer container;
  auto& context = container.component();
  auto publisher = context.advertise<Cloud>(kPort, {.max_loans = 2});
  context.subscribe<Cloud>(kPort, [&](const auto& cloud) { last = cloud->header().frame_id(); });
  container.activate();
  auto first = publisher.loan();
  std::optional<Loan<Cloud>> second = publisher.loan();
  EXPECT_THAT([&] { (void)publisher.loan(); },
              ThrowsMessage<LoanError>(HasSubstr("/camvox/cloud")));
  second.reset();
  auto third = publisher.loan();
  EXPECT_THROW((void)publisher.loan(), LoanError);
  first->header().frame_id(1);
  publisher.publish(std::move(first));
  auto fourth = publisher.loan();
  fourth->header().frame_id(2);
  publisher.publish(std::move(fourth));
  EXPECT_TRUE(wait_until([&] { return last == 2; })) << "nothing was lost on the way";
}

TEST(Loans, OfRosMessagesAreLimitedToo) {
  test::TestContainer container;
  auto publisher = container.component().advertise<Imu>({"imu", topics::kImu}, {.max_loans = 1});
  auto first = publisher.loan();
  EXPECT_THROW((void)publisher.loan(), LoanError);
  publisher.publish(std::move(first));
  EXPECT_NO_THROW((void)publisher.loan());
}

TEST(Loans, DroppedThousandsOfTimesLeaveThePoolWhole) {
  test::TestContainer container;
  auto publisher = container.component().advertise<Cloud>(kPort, {.max_loans = 1});
  for (int i = 0; i < 5000; ++i) (void)publisher.loan();
  EXPECT_NO_THROW((void)publisher.loan());
}

TEST(Loans, OverCapacityIsRefusedAndTheSampleIsFreeAgain) {
  test::TestContainer container;
  auto publisher = container.component().advertise<Cloud>(kPort, {.max_loans = 1});
  for (int i = 0; i < 50; ++i) {
    auto cloud = publisher.loan();
    cloud->points_count() = static_cast<std::uint32_t>(cloud->points().size()) + 1;
    EXPECT_THAT([&] { publisher.publish(std::move(cloud)); },
                ThrowsMessage<std::logic_error>(HasSubstr("capacity")));
  }
}

TEST(Loans, ManyPublishersAndReadersOfOneTopicNeverStarveEachOther) {
  constexpr std::uint64_t kSent = 200;
  std::atomic<std::uint64_t> received = 0;
  test::TestContainer container;
  std::vector<Publisher<Cloud>> publishers;
  for (int i = 0; i < 3; ++i) {
    auto& context = container.component();
    publishers.push_back(context.advertise<Cloud>(kPort, {.qos = qos::kFrames, .max_loans = 1}));
    context.subscribe<Cloud>(kPort, [&](const auto&) { ++received; }, {.qos = qos::kFrames});
  }
  container.activate();
  for (std::uint64_t i = 0; i < kSent; ++i) {
    for (auto& publisher : publishers) publisher.publish(publisher.loan());
  }
  EXPECT_TRUE(test::wait_until([&] { return received > 0; }));
}

}  // namespace
}  // namespace camvox
