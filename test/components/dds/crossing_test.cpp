#include <gmock/gmock.h>

#include <atomic>
#include <fstream>
#include <set>

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/test/deadline.hpp"
#include "camvox/test/test_container.hpp"
#include "dds_child.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Cloud;
using camvox_interfaces::msg::Extrinsics;
using test::wait_until;

constexpr Port kPort{"cloud", topics::kCloud};
constexpr Port kExtrinsicsPort{"extrinsics", topics::kExtrinsics};

void publish(Publisher<Cloud>& publisher, std::uint64_t frame, std::uint32_t points) {
  auto cloud = publisher.loan();
  cloud->header().frame_id(frame);
  cloud->points_count() = points;
  for (std::uint32_t i = 0; i < points; ++i) cloud->points()[i].fill(static_cast<float>(i));
  publisher.publish(std::move(cloud));
}

dds::ParticipantOptions over(const std::string& transport) {
  auto options = test::test_options();
  options.udp = transport != "shm";
  options.shared_memory = transport != "udp";
  return options;
}

class Crossing : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Transports, Crossing, ::testing::Values("udp", "shm", "any"));

TEST_P(Crossing, SendsOnlyTheUsedPart) {
  test::TestContainer container(over(GetParam()));
  auto publisher = container.component().advertise<Cloud>(kPort);
  container.activate();
  auto child = test::start_child(GetParam(), "measure");
  ASSERT_TRUE(child.wrote("matched")) << child.output();
  ASSERT_TRUE(wait_until([&] { return publisher.subscriber_count() > 0; })) << child.output();
  // 4 encapsulation, 16 header, 80 velocities and rotation, 4 octets, 4 length, 16 a point.
  for (const std::uint32_t points : {0U, 1U, 1000U, 100'000U}) {
    publish(publisher, 1, points);
    EXPECT_TRUE(child.wrote("bytes " + std::to_string(108 + 16 * points) + "\n")) << child.output();
  }
  child.tell("quit");
  EXPECT_EQ(child.wait(), 0);
}

TEST_P(Crossing, InternalTopicReachesComponentsOfAnotherProcess) {
  test::TestContainer container(over(GetParam()));
  auto publisher = container.component().advertise<Cloud>(kPort);
  container.activate();
  auto child = test::start_child(GetParam(), "read");
  ASSERT_TRUE(child.wrote("matched")) << child.output();
  ASSERT_TRUE(wait_until([&] { return publisher.subscriber_count() > 0; })) << child.output();
  for (std::uint64_t frame = 1; frame <= 5; ++frame) {
    publish(publisher, frame, 10'000);
    EXPECT_TRUE(child.wrote("frame " + std::to_string(frame) + " points 10000\n"))
        << child.output();
  }
  child.tell("quit");
  EXPECT_EQ(child.wait(), 0);
}

/// Ports of the shared-memory transport that a process has mapped: its own, and one of each peer
/// that it sends to this way.
std::size_t mapped_shared_memory_ports(pid_t process) {
  std::ifstream maps("/proc/" + std::to_string(process) + "/maps");
  std::set<std::string> ports;
  for (std::string line; std::getline(maps, line);) {
    const auto name = line.find("/dev/shm/fastrtps_port");
    if (name != std::string::npos) ports.insert(line.substr(name));
  }
  return ports.size();
}

TEST_P(Crossing, SharedMemoryIsTakenWhereBothHaveIt) {
  std::atomic<int> received = 0;
  test::TestContainer container(over(GetParam()));
  container.component().subscribe<Cloud>(
      kPort, [&](const auto&) { ++received; }, {.qos = qos::kFrames});
  container.activate();
  auto child = test::start_child(GetParam(), "write");
  ASSERT_TRUE(wait_until([&] { return received >= 5; })) << child.output();
  const std::size_t expected = GetParam() == std::string("udp") ? 0 : 2;
  EXPECT_EQ(mapped_shared_memory_ports(child.pid()), expected);
  child.tell("quit");
  EXPECT_EQ(child.wait(), 0);
}

TEST(CrossingBorder, NobodyOutsideMeansNoReaderOfTheGateway) {
  test::TestContainer container;
  auto publisher = container.component().advertise<Cloud>(kPort);
  container.activate();
  EXPECT_EQ(publisher.subscriber_count(), 0U);
  auto child = test::start_child("any", "read");
  EXPECT_TRUE(wait_until([&] { return publisher.subscriber_count() == 1; })) << child.output();
  child.tell("quit");
  EXPECT_EQ(child.wait(), 0);
  EXPECT_TRUE(wait_until([&] { return publisher.subscriber_count() == 0; }));
}

class SharedMemory : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(WithAndWithout, SharedMemory, ::testing::Bool());

// The writer scribbles over the sample after publishing it: only a reader of the very same memory
// sees that. Without `zero_copy: interprocess` the other process must have a copy.
TEST_P(SharedMemory, InterprocessReaderLooksAtTheWritersMemory) {
  dds::TopicSettingsMap settings;
  settings[std::string(topics::kCloud)].interprocess_zero_copy = GetParam();
  test::TestContainer container(test::test_options(), settings);
  auto publisher = container.component().advertise<Cloud>(kPort);
  container.activate();
  auto child = test::start_child(GetParam() ? "shared" : "any", "hold");
  ASSERT_TRUE(child.wrote("matched")) << child.output();
  ASSERT_TRUE(wait_until([&] { return publisher.subscriber_count() > 0; })) << child.output();
  auto cloud = publisher.loan();
  cloud->points_count() = 1;
  cloud->points()[0][0] = 111;
  Cloud* const published = &*cloud;
  publisher.publish(std::move(cloud));
  ASSERT_TRUE(child.wrote("holding 111\n")) << child.output();
  published->points()[0][0] = 222;
  child.tell("look");
  EXPECT_TRUE(child.wrote(GetParam() ? "seen 222\n" : "seen 111\n")) << child.output();
  child.tell("quit");
  EXPECT_EQ(child.wait(), 0) << child.output();
}

TEST(SharedMemoryTopic, ReachesOwnComponentsAndOtherProcessesAtOnce) {
  dds::TopicSettingsMap settings;
  settings[std::string(topics::kCloud)].interprocess_zero_copy = true;
  std::atomic<std::uint64_t> last = 0;
  test::TestContainer container(test::test_options(), settings);
  auto publisher = container.component("writer").advertise<Cloud>(kPort);
  container.component("reader").subscribe<Cloud>(
      kPort, [&](const auto& cloud) { last = cloud->header().frame_id(); });
  container.activate();
  auto child = test::start_child("shared", "read");
  ASSERT_TRUE(child.wrote("matched")) << child.output();
  ASSERT_TRUE(wait_until([&] { return publisher.subscriber_count() > 1; })) << child.output();
  for (std::uint64_t frame = 1; frame <= 20; ++frame) {
    publish(publisher, frame, 100);
    EXPECT_TRUE(child.wrote("frame " + std::to_string(frame) + " points 100\n")) << child.output();
    EXPECT_TRUE(wait_until([&] { return last == frame; }));
  }
}

TEST(Latched, LateComponentGetsTheLastStateInPlace) {
  std::atomic<std::uint64_t> version = 0;
  std::atomic<const void*> address = nullptr;
  test::TestContainer container;
  auto publisher =
      container.component("writer").advertise<Extrinsics>(kExtrinsicsPort, {.qos = qos::kState});
  container.activate();
  const void* last = nullptr;
  for (std::uint64_t i = 1; i <= 3; ++i) {
    auto extrinsics = publisher.loan();
    extrinsics->version(i);
    last = &*extrinsics;
    publisher.publish(std::move(extrinsics));
  }
  container.component("late").subscribe<Extrinsics>(kExtrinsicsPort,
                                                    [&](const Sample<Extrinsics>& extrinsics) {
                                                      address = &*extrinsics;
                                                      version = extrinsics->version();
                                                    },
                                                    {.qos = qos::kState});
  container.activate();
  EXPECT_TRUE(wait_until([&] { return version == 3; }));
  EXPECT_EQ(address, last);
}

TEST(Latched, LateProcessGetsTheLastStateAndSoDoesItsLateComponent) {
  test::TestContainer container;
  auto publisher =
      container.component().advertise<Extrinsics>(kExtrinsicsPort, {.qos = qos::kState});
  container.activate();
  for (std::uint64_t i = 1; i <= 3; ++i) {
    auto extrinsics = publisher.loan();
    extrinsics->version(i);
    publisher.publish(std::move(extrinsics));
  }
  auto child = test::start_child("any", "read_latched");
  EXPECT_TRUE(child.wrote("first version 3\n")) << child.output();
  child.tell("again");
  EXPECT_TRUE(child.wrote("second version 3\n")) << child.output();
}

TEST(Malformed, MessagesOfAnotherProcessAreCountedAndTheNextIsRead) {
  std::atomic<std::uint32_t> points = 0;
  test::TestContainer container;
  const auto subscription = container.component().subscribe<Cloud>(
      kPort, [&](const auto& cloud) { points = cloud->points_count(); });
  container.activate();
  auto child = test::start_child("any", "write_malformed");
  ASSERT_TRUE(child.wrote("written")) << child.output();
  EXPECT_TRUE(wait_until([&] { return points == 4; })) << subscription->stats().rejected;
  EXPECT_EQ(subscription->stats().rejected, 3U);
  EXPECT_EQ(subscription->stats().received, 1U);
}

}  // namespace
}  // namespace camvox
