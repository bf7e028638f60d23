#include <gmock/gmock.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "camvox/dds/shared_memory.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/test/deadline.hpp"
#include "camvox/test/test_container.hpp"
#include "dds_child.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Cloud;
using test::wait_until;
using ::testing::Contains;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;

constexpr Port kPort{"cloud", topics::kCloud};

dds::TopicSettingsMap shared_topics() {
  dds::TopicSettingsMap settings;
  settings[std::string(topics::kCloud)].interprocess_zero_copy = true;
  return settings;
}

std::vector<std::string> shared_memory_files() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/shm")) {
    names.push_back(entry.path().filename());
  }
  return names;
}

class KilledProcess : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Transports, KilledProcess, ::testing::Values("udp", "shm", "any"));

dds::ParticipantOptions over(const std::string& transport) {
  auto options = test::test_options();
  options.udp = transport != "shm";
  options.shared_memory = transport != "udp";
  return options;
}

TEST_P(KilledProcess, ReaderCarriesOnAndHearsTheNextWriter) {
  std::atomic<std::uint64_t> received = 0;
  test::TestContainer container(over(GetParam()));
  container.component().subscribe<Cloud>(
      kPort, [&](const auto&) { ++received; }, {.qos = qos::kFrames});
  container.activate();
  for (int life = 1; life <= 3; ++life) {
    auto child = test::start_child(GetParam(), "write");
    const auto before = received.load();
    ASSERT_TRUE(wait_until([&] { return received >= before + 20; }))
        << "life " << life << ": " << child.output();
    child.kill_hard();
  }
  EXPECT_THAT(container.errors(), IsEmpty());
}

TEST_P(KilledProcess, WriterCarriesOnAndReachesTheNextReader) {
  test::TestContainer container(over(GetParam()));
  auto& context = container.component();
  auto publisher = context.advertise<Cloud>(kPort, {.qos = qos::kFrames});
  std::uint64_t frame = 0;
  context.every(std::chrono::milliseconds(10), [&] {
    auto cloud = publisher.loan();
    cloud->header().frame_id(++frame);
    cloud->points_count() = 1000;
    publisher.publish(std::move(cloud));
  });
  container.activate();
  for (int life = 1; life <= 3; ++life) {
    auto child = test::start_child(GetParam(), "read");
    ASSERT_TRUE(child.wrote("points 1000\n")) << "life " << life << ": " << child.output();
    child.kill_hard();
  }
  EXPECT_THAT(container.errors(), IsEmpty());
  container.remove(context);
}

TEST(KilledSharedMemory, NextProcessStartsAndLeftoversAreRemoved) {
  std::atomic<std::uint64_t> received = 0;
  test::TestContainer container(test::test_options(), shared_topics());
  container.component().subscribe<Cloud>(kPort, [&](const auto&) { ++received; });
  container.activate();
  const auto before = shared_memory_files();
  std::vector<std::string> left;
  {
    auto child = test::start_child("shared", "write");
    ASSERT_TRUE(wait_until([&] { return received >= 20; })) << child.output();
    for (const auto& name : shared_memory_files()) {
      if (std::find(before.begin(), before.end(), name) == before.end()) left.push_back(name);
    }
    child.kill_hard();
  }
  ASSERT_THAT(left, Contains(::testing::StartsWith("fast_datasharing")));
  {
    const auto count = received.load();
    auto child = test::start_child("shared", "write");
    EXPECT_TRUE(wait_until([&] { return received >= count + 20; })) << child.output();
    child.tell("quit");
    EXPECT_EQ(child.wait(), 0) << child.output();
  }
  // Our own reader lets go of the killed writer's memory when its lease has run out.
  EXPECT_TRUE(wait_until([&] {
    (void)dds::remove_stale_shared_memory();
    const auto now = shared_memory_files();
    return std::none_of(now.begin(), now.end(), [&](const std::string& name) {
      return name.starts_with("fast_datasharing") &&
             std::find(left.begin(), left.end(), name) != left.end();
    });
  }));
}

constexpr std::chrono::milliseconds kStaleAge{3100};  // what is younger is left alone anyway

/// Files in shared memory that a process has mapped.
std::vector<std::string> mapped_files(pid_t process) {
  const std::string folder = "/dev/shm/";
  std::ifstream maps("/proc/" + std::to_string(process) + "/maps");
  std::set<std::string> names;
  for (std::string line; std::getline(maps, line);) {
    const auto start = line.find(folder + "fast");
    if (start != std::string::npos) names.insert(line.substr(start + folder.size()));
  }
  return {names.begin(), names.end()};
}

/// A child that writes through shared memory, and a container that may read it.
class StaleSharedMemory : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(child_.wrote("ready")) << child_.output();
    living_ = mapped_files(child_.pid());
    ASSERT_THAT(living_, Contains(::testing::StartsWith("fast_datasharing")));
    std::this_thread::sleep_for(kStaleAge);
  }

  std::atomic<std::uint64_t> received_ = 0;
  test::TestContainer container_{test::test_options(), shared_topics()};
  test::ChildProcess child_ = test::start_child("shared", "write");
  std::vector<std::string> living_;
};

TEST_F(StaleSharedMemory, OfLivingProcessesIsLeftAlone) {
  (void)dds::remove_stale_shared_memory();
  EXPECT_THAT(shared_memory_files(), IsSupersetOf(living_));
  container_.component().subscribe<Cloud>(kPort, [&](const auto&) { ++received_; });
  container_.activate();
  EXPECT_TRUE(wait_until([&] { return received_ >= 5; })) << "the child's memory was taken away";
}

// In a user namespace of its own, or in another container, a process shares /dev/shm with processes
// that it may not look into.
TEST_F(StaleSharedMemory, OfProcessesThatCannotBeLookedIntoIsLeftAlone) {
  test::ChildProcess stranger({"unshare",
                               "--user",
                               "--map-root-user",
                               DDS_CHILD,
                               std::to_string(test::own_domain()),
                               "any",
                               "clean"});
  const int code = stranger.wait();
  if (stranger.wrote("unshare:", std::chrono::milliseconds(0))) {
    GTEST_SKIP() << "no user namespaces here: " << stranger.output();
  }
  ASSERT_EQ(code, 0) << stranger.output();
  EXPECT_THAT(shared_memory_files(), IsSupersetOf(living_)) << stranger.output();
}

}  // namespace
}  // namespace camvox
