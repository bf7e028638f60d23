#include "camvox/recording/record_component.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <fstream>

#include "bag_files.hpp"
#include "camvox/component/fake_context.hpp"
#include "camvox/interfaces/std_msgs.hpp"

namespace camvox {
namespace {

using recording::kStart_ns;
using recording::TemporaryFolder;

TopicDescription topic(const std::string& name, const std::string& type) {
  TopicDescription description;
  description.name = name;
  description.type_name = type;
  description.publishers = 1;
  return description;
}

RawMessage message(std::uint8_t content) { return {recording::stamped_cdr(kStart_ns, content)}; }

TEST(RecordComponent, RecordsEveryTopicWithItsDefinition) {
  const TemporaryFolder folder;
  FakeContext fake;
  fake.set_parameter("output", folder.file("out"));
  fake.set_topics({topic("/imu", "sensor_msgs/msg/Imu"), topic("/other", "x_msgs/msg/Unknown")});
  {
    RecordComponent record(fake);
    record.start();
    fake.send("/imu", message(1));
    fake.send("/other", message(2));
    fake.set_topics({topic("/late", "std_msgs/msg/Header")});
    fake.advance(std::chrono::milliseconds(100));
    fake.send("/late", message(3));
  }
  const auto bag = recording::open_bag(folder.file("out"));
  ASSERT_EQ(bag->topics().size(), 3U);
  EXPECT_EQ(bag->topics()[0].type, "sensor_msgs/msg/Imu");
  EXPECT_THAT(bag->topics()[0].schema, ::testing::HasSubstr("MSG: geometry_msgs/Vector3"));
  EXPECT_THAT(bag->topics()[0].type_description_hash, ::testing::StartsWith("RIHS01_7d9a00ff"));
  std::vector<int> contents;
  auto cursor = bag->messages();
  while (const auto* stored = cursor.next()) {
    contents.push_back(static_cast<int>(stored->data.back()));
  }
  EXPECT_THAT(contents, ::testing::ElementsAre(1, 2, 3));
  EXPECT_THAT(fake.log_entries().at(2).text, ::testing::HasSubstr("x_msgs/msg/Unknown"));
}

/// A publisher elsewhere may call anything by the name of a topic that this process has already.
TEST(RecordComponent, ATopicThatCannotBeReadCostsOnlyItself) {
  const TemporaryFolder folder;
  FakeContext fake;
  fake.set_parameter("output", folder.file("out"));
  fake.subscribe<std_msgs::msg::Header>({"/clash", "/clash"}, [](const auto&) {});
  fake.set_topics({topic("/clash", "sensor_msgs/msg/Imu"), topic("/good", "std_msgs/msg/Header")});
  {
    RecordComponent record(fake);
    ASSERT_NO_THROW(record.start());
    fake.send("/good", message(1));
    EXPECT_NO_THROW(fake.advance(std::chrono::seconds(2)));
  }
  const auto bag = recording::open_bag(folder.file("out"));
  ASSERT_EQ(bag->topics().size(), 1U);
  EXPECT_EQ(bag->topics()[0].name, "/good");
  EXPECT_EQ(bag->message_count(), 1U);
  const auto entries = fake.log_entries();
  EXPECT_EQ(std::count_if(entries.begin(),
                          entries.end(),
                          [](const auto& entry) {
                            return entry.level == LogLevel::kError &&
                                   entry.text.starts_with("/clash: not recorded");
                          }),
            1);
}

/// Lets no file of this process grow beyond a size, as a full disk would.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST(RecordComponent, AFullDiskIsToldWhenItStops) {
  const TemporaryFolder folder;
  FakeContext fake;
  fake.set_parameter("output", folder.file("out"));
  fake.set_topics({topic("/imu", "sensor_msgs/msg/Imu")});
  const FileSizeLimit limit(10'000);
  {
    RecordComponent record(fake);
    record.start();
    fake.send("/imu", RawMessage{std::vector<std::uint8_t>(20'000)});
    EXPECT_THAT([&] { record.stop(); },
                ::testing::ThrowsMessage<std::runtime_error>(::testing::HasSubstr("out_0.mcap")));
  }
  for (const auto& entry : fake.log_entries()) {
    EXPECT_NE(entry.level, LogLevel::kError) << "told once: " << entry.text;
  }
}

TEST(RecordComponent, StopsWithoutAnErrorWhenAllIsSaved) {
  const TemporaryFolder folder;
  FakeContext fake;
  fake.set_parameter("output", folder.file("out"));
  fake.set_topics({topic("/imu", "sensor_msgs/msg/Imu")});
  RecordComponent record(fake);
  record.start();
  fake.send("/imu", message(1));
  EXPECT_NO_THROW(record.stop());
  EXPECT_EQ(recording::open_bag(folder.file("out"))->message_count(), 1U);
}

TEST(RecordComponent, LeavesOutWhatIsExcludedOrNotAskedFor) {
  const TemporaryFolder folder;
  FakeContext fake;
  fake.set_parameter("output", folder.file("out"));
  fake.set_parameter("topics", std::vector<std::string>{"/a", "/b"});
  fake.set_parameter("exclude", std::vector<std::string>{"/b"});
  fake.set_topics({topic("/a", "std_msgs/msg/Header"),
                   topic("/b", "std_msgs/msg/Header"),
                   topic("/c", "std_msgs/msg/Header")});
  {
    RecordComponent record(fake);
    record.start();
    fake.send("/a", message(1));
    EXPECT_THROW(fake.send("/b", message(2)), std::logic_error);
    EXPECT_THROW(fake.send("/c", message(3)), std::logic_error);
  }
  EXPECT_EQ(recording::open_bag(folder.file("out"))->message_count(), 1U);
}

TEST(RecordComponent, DemandsWhatIsOfferedUnlessTheFileSaysOtherwise) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("qos.yaml"))
      << "/b: {reliability: best_effort, history: keep_last, depth: 7}\n"
         "/c: {durability: transient_local}\n";
  FakeContext fake;
  fake.set_parameter("output", folder.file("out"));
  fake.set_parameter("qos_overrides", folder.file("qos.yaml"));
  auto latched = topic("/a", "std_msgs/msg/Header");
  latched.offered.latched = true;
  fake.set_topics(
      {latched, topic("/b", "std_msgs/msg/Header"), topic("/c", "std_msgs/msg/Header")});
  RecordComponent record(fake);
  record.start();
  EXPECT_TRUE(fake.subscription_qos("/a").reliable && fake.subscription_qos("/a").latched);
  EXPECT_EQ(fake.subscription_qos("/b"), (Qos{7, false, false}));
  EXPECT_TRUE(fake.subscription_qos("/c").latched);
  std::string warnings;
  for (const auto& entry : fake.log_entries()) {
    if (entry.level == LogLevel::kWarn) warnings += entry.text + "\n";
  }
  EXPECT_THAT(warnings, ::testing::HasSubstr("/c: the QoS override demands"));
  EXPECT_THAT(warnings, ::testing::Not(::testing::HasSubstr("/b")));
}

TEST(RecordComponent, AFileOfOverridesThatCannotBeReadIsAnErrorAtOnce) {
  FakeContext fake;
  fake.set_parameter("output", std::string("/tmp/never"));
  fake.set_parameter("qos_overrides", std::string("/no/such/qos.yaml"));
  EXPECT_THAT([&] { RecordComponent record(fake); },
              ::testing::ThrowsMessage<std::runtime_error>(
                  ::testing::HasSubstr("/no/such/qos.yaml: cannot be read")));
}

TEST(RecordComponent, NeverOverwritesARecording) {
  const TemporaryFolder folder;
  FakeContext fake;
  fake.set_parameter("output", folder.file(""));
  RecordComponent record(fake);
  EXPECT_THROW(record.start(), std::runtime_error);
}

}  // namespace
}  // namespace camvox
