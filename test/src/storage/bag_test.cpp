/// Bags as a whole: what BagWriter writes, BagReader reads, and so it does with real ones.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include "camvox/storage/bag_reader.hpp"
#include "camvox/storage/bag_writer.hpp"
#include "camvox/storage/doctor.hpp"
#include "camvox/storage/qos_profile.hpp"
#include "mcap_files.hpp"

namespace camvox::storage {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

BagTopic topic(const std::string& name, const std::string& type) {
  BagTopic topic;
  topic.name = name;
  topic.type = type;
  topic.schema = "int32 data\n";
  topic.offered_qos_profiles = to_yaml({QosProfile{}});
  topic.type_description_hash = "RIHS01_00";
  return topic;
}

using Seen = std::vector<std::pair<std::int64_t, std::string>>;  // time, topic and data

Seen read_bag(const BagReader& bag, const MessageFilter& filter = {}) {
  Seen seen;
  auto cursor = bag.messages(filter);
  while (const BagMessage* message = cursor.next()) {
    seen.emplace_back(message->log_time_ns,
                      bag.topics()[message->topic].name + std::string(as_text(message->data)));
  }
  EXPECT_TRUE(cursor.status().ok()) << cursor.status().message();
  return seen;
}

/// 100 messages, 1 ms apart, in turn on /a and /b.
Seen write_bag(const std::filesystem::path& folder, const BagWriterOptions& options) {
  auto bag = BagWriter::create(folder, options);
  EXPECT_TRUE(bag.ok()) << bag.status().message();
  EXPECT_EQ(*(*bag)->add_topic(topic("/a", "std_msgs/msg/Int32")), 0U);
  EXPECT_EQ(*(*bag)->add_topic(topic("/b", "std_msgs/msg/Int32")), 1U);
  EXPECT_EQ(*(*bag)->add_topic(topic("/silent", "std_msgs/msg/Int32")), 2U);
  Seen written;
  for (std::int64_t i = 0; i < 100; ++i) {
    const std::string data(100, static_cast<char>('0' + i % 50));
    const auto number = static_cast<std::size_t>(i % 2);
    const std::int64_t time_ns = 1'700'000'000'000'000'000 + i * 1'000'000;
    EXPECT_TRUE((*bag)->write(number, time_ns, time_ns - 5, as_bytes(data)).ok());
    written.emplace_back(time_ns, (number == 0 ? "/a" : "/b") + data);
  }
  EXPECT_TRUE((*bag)->close().ok());
  return written;
}

TEST(Bag, WrittenAndReadAsAFolder) {
  const auto folder = fresh_folder("bag_folder") / "drive";
  const auto written = write_bag(folder, {});
  EXPECT_TRUE(std::filesystem::exists(folder / "drive_0.mcap"));
  const auto bag = BagReader::open(folder);
  ASSERT_TRUE(bag.ok()) << bag.status().message();
  EXPECT_THAT((*bag)->problems(), IsEmpty());
  EXPECT_EQ(read_bag(**bag), written);
  EXPECT_EQ((*bag)->message_count(), 100U);
  EXPECT_EQ((*bag)->start_time_ns(), written.front().first);
  EXPECT_EQ((*bag)->end_time_ns(), written.back().first);
  ASSERT_THAT((*bag)->topics(), SizeIs(3));
  BagTopic expected = topic("/b", "std_msgs/msg/Int32");
  expected.message_count = 50;
  EXPECT_EQ((*bag)->topics()[1], expected);
  EXPECT_EQ((*bag)->topics()[2].message_count, 0U);
}

/// The keys that rosbag2 requires, read by name as it does.
TEST(Bag, MetadataYamlHasWhatRosbag2Reads) {
  const auto folder = fresh_folder("bag_yaml") / "drive";
  BagWriterOptions options;
  options.ros_distro = "jazzy";
  options.custom_data = {{"rig", "A: 'quoted' \"text\""}};
  write_bag(folder, options);
  const auto info =
      YAML::LoadFile((folder / "metadata.yaml").string())["rosbag2_bagfile_information"];
  EXPECT_EQ(info["version"].as<int>(), 8);
  EXPECT_EQ(info["storage_identifier"].as<std::string>(), "mcap");
  EXPECT_EQ(info["duration"]["nanoseconds"].as<std::int64_t>(), 99'000'000);
  EXPECT_EQ(info["starting_time"]["nanoseconds_since_epoch"].as<std::int64_t>(),
            1'700'000'000'000'000'000);
  EXPECT_EQ(info["message_count"].as<int>(), 100);
  const auto first = info["topics_with_message_count"][0];
  EXPECT_EQ(first["topic_metadata"]["name"].as<std::string>(), "/a");
  EXPECT_EQ(first["topic_metadata"]["type"].as<std::string>(), "std_msgs/msg/Int32");
  EXPECT_EQ(first["topic_metadata"]["serialization_format"].as<std::string>(), "cdr");
  const auto qos = YAML::Load(first["topic_metadata"]["offered_qos_profiles"].as<std::string>());
  EXPECT_EQ(qos[0]["reliability"].as<int>(), 1);
  EXPECT_EQ(qos[0]["deadline"]["sec"].as<std::uint64_t>(), 9223372036U);
  EXPECT_EQ(first["message_count"].as<int>(), 50);
  EXPECT_EQ(info["relative_file_paths"][0].as<std::string>(), "drive_0.mcap");
  EXPECT_EQ(info["files"][0]["path"].as<std::string>(), "drive_0.mcap");
  EXPECT_EQ(info["files"][0]["message_count"].as<int>(), 100);
  EXPECT_EQ(info["custom_data"]["rig"].as<std::string>(), "A: 'quoted' \"text\"");
  EXPECT_EQ(info["ros_distro"].as<std::string>(), "jazzy");
  EXPECT_EQ(info["compression_format"].as<std::string>(), "");
}

TEST(Bag, EveryVersionOfTheMetadataComesBack) {
  BagMetadata metadata;
  metadata.message_count = 3;
  metadata.starting_time_ns = 12;
  metadata.duration_ns = 7;
  metadata.topics = {{"/a", "p/msg/T", "cdr", to_yaml({QosProfile{}}), "", 3}};
  metadata.files = {{"x_0.mcap", 12, 7, 3}};
  for (metadata.version = 5; metadata.version <= 9; ++metadata.version) {
    const auto parsed = parse_bag_metadata(to_yaml(metadata));
    ASSERT_TRUE(parsed.ok()) << parsed.status().message();
    EXPECT_EQ(*parsed, metadata);
  }
  EXPECT_FALSE(parse_bag_metadata("").ok());
  EXPECT_FALSE(parse_bag_metadata("[1, 2").ok());
  EXPECT_FALSE(parse_bag_metadata("version: many").ok());
  EXPECT_FALSE(parse_bag_metadata("version: 5\ntopics_with_message_count: [1]").ok());
}

TEST(Bag, SplitsBySizeAndReadsTheFilesInOrder) {
  const auto folder = fresh_folder("bag_size") / "drive";
  BagWriterOptions options;
  options.max_file_size = 1500;
  options.mcap.chunk_size = 400;
  const auto written = write_bag(folder, options);
  const auto bag = BagReader::open(folder);
  ASSERT_TRUE(bag.ok());
  EXPECT_GT((*bag)->files().size(), 10U);  // so that _10 must not come before _2
  EXPECT_EQ(read_bag(**bag), written);
  std::filesystem::remove(folder / "metadata.yaml");
  const auto without = BagReader::open(folder);
  ASSERT_TRUE(without.ok());
  EXPECT_THAT((*without)->problems(), SizeIs(1));
  EXPECT_EQ((*without)->files(), (*bag)->files());
  EXPECT_EQ(read_bag(**without), written);
}

TEST(Bag, SplitsByTimeAndTellsSo) {
  const auto folder = fresh_folder("bag_time") / "drive";
  BagWriterOptions options;
  options.max_file_duration_ns = 30'000'000;
  const auto written = write_bag(folder, options);
  const auto bag = BagReader::open(folder);
  ASSERT_TRUE(bag.ok());
  ASSERT_THAT((*bag)->files(), SizeIs(4));
  EXPECT_EQ((*bag)->metadata().files[1].starting_time_ns, written[30].first);
  EXPECT_EQ((*bag)->metadata().files[1].duration_ns, 29'000'000);
  const auto start_ns = static_cast<std::uint64_t>(written[40].first);
  EXPECT_EQ(read_bag(**bag, {.start_time_ns = start_ns, .topics = {}}),
            Seen(written.begin() + 40, written.end()));
  EXPECT_THAT(read_bag(**bag, {.topics = {"/b"}}), SizeIs(50));
  for (const auto& path : (*bag)->files()) {
    const auto source = FileSource::open(path);
    EXPECT_FALSE(doctor(**source).has_errors()) << path;
  }
}

TEST(Bag, FilesThatOverlapAreMerged) {
  const auto folder = fresh_folder("bag_overlap");
  auto messages = make_messages(60, 20);
  std::vector<TestMessage> parts[2];
  for (std::size_t i = 0; i < messages.size(); ++i) parts[i / 7 % 2].push_back(messages[i]);
  write_text(folder / "x_0.mcap", write_file(parts[0], {}));
  write_text(folder / "x_1.mcap", write_file(parts[1], {}));
  const auto bag = BagReader::open(folder);
  ASSERT_TRUE(bag.ok());
  EXPECT_THAT((*bag)->topics(), SizeIs(2));
  auto cursor = (*bag)->messages();
  for (const auto& expected : messages) {
    const BagMessage* message = cursor.next();
    ASSERT_NE(message, nullptr);
    EXPECT_EQ(message->sequence, expected.sequence);
    EXPECT_EQ(as_text(message->data), expected.data);
  }
  EXPECT_EQ(cursor.next(), nullptr);
}

TEST(Bag, WithoutCloseEveryFlushedMessageIsThere) {
  const auto folder = fresh_folder("bag_crash") / "drive";
  auto bag = BagWriter::create(folder);
  ASSERT_TRUE(bag.ok());
  ASSERT_TRUE((*bag)->add_topic(topic("/a", "std_msgs/msg/Int32")).ok());
  for (int i = 0; i < 10; ++i) ASSERT_TRUE((*bag)->write(0, i, i, as_bytes("data")).ok());
  ASSERT_TRUE((*bag)->flush().ok());
  const auto reader = BagReader::open(folder);  // as after a crash: no metadata.yaml, no summary
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_THAT(read_bag(**reader), SizeIs(10));
  EXPECT_THAT((*reader)->problems(), SizeIs(3));
}

TEST(Bag, MistakesAreSaid) {
  const auto folder = fresh_folder("bag_mistakes");
  EXPECT_THAT(BagWriter::create(folder).status().message(), HasSubstr("exists already"));
  EXPECT_EQ(BagReader::open(folder).status().code(), StatusCode::kIo);
  EXPECT_EQ(BagReader::open(folder / "none").status().code(), StatusCode::kIo);
  auto bag = BagWriter::create(folder / "b");
  EXPECT_EQ((*bag)->write(0, 1, 1, {}).code(), StatusCode::kInvalid);
  ASSERT_TRUE((*bag)->add_topic(topic("/a", "p/msg/T")).ok());
  EXPECT_EQ((*bag)->add_topic(topic("/a", "p/msg/U")).status().code(), StatusCode::kInvalid);
  EXPECT_EQ((*bag)->write(0, -1, 1, {}).code(), StatusCode::kInvalid);
  EXPECT_TRUE((*bag)->write(0, 1, 1, {}).ok());
  EXPECT_TRUE((*bag)->close().ok());
  EXPECT_EQ((*bag)->write(0, 1, 1, {}).code(), StatusCode::kInvalid);
  write_text(folder / "b" / "metadata.yaml",
             "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths: [../..]\n");
  EXPECT_EQ(BagReader::open(folder / "b").status().code(), StatusCode::kCorrupt);
}

TEST(Bag, RealRosbag2FilesOpenOneByOne) {
  const auto files = files_under(recordings() / "rosbag2", ".mcap");
  if (files.empty()) GTEST_SKIP() << "no rosbag2 files in " << recordings();
  for (const auto& path : files) {
    const auto bag = BagReader::open(path);
    ASSERT_TRUE(bag.ok()) << bag.status().message();
    EXPECT_THAT((*bag)->problems(), IsEmpty());
    EXPECT_EQ(read_bag(**bag).size(), (*bag)->message_count());
    for (const auto& t : (*bag)->topics()) {
      EXPECT_TRUE(parse_qos_profiles(t.offered_qos_profiles).ok()) << t.offered_qos_profiles;
      EXPECT_FALSE(t.type.empty());
    }
  }
}

TEST(Bag, RealMetadataRecordIsRead) {
  const auto path = recordings() / "rosbag2" / "bag_with_topics_and_service_events.mcap";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
  const auto bag = BagReader::open(path);
  ASSERT_TRUE(bag.ok());
  EXPECT_EQ((*bag)->metadata().version, 8);
  EXPECT_EQ((*bag)->message_count(), 10U);
  EXPECT_THAT((*bag)->topics(), SizeIs(5));
  const std::string yaml = (*bag)->file(0).metadata("rosbag2")->metadata.at("serialized_metadata");
  EXPECT_EQ(to_yaml(*parse_bag_metadata(yaml)), yaml) << "not what rosbag2 writes";
}

TEST(QosProfile, NumbersAndWordsMeanTheSame) {
  QosProfile profile;
  profile.history = QosProfile::History::kKeepAll;
  profile.reliability = QosProfile::Reliability::kBestEffort;
  profile.durability = QosProfile::Durability::kTransientLocal;
  profile.liveliness = QosProfile::Liveliness::kManualByTopic;
  profile.depth = 7;
  profile.deadline = {1, 2};
  EXPECT_EQ(*parse_qos_profiles(to_yaml({profile, QosProfile{}})),
            (std::vector{profile, QosProfile{}}));
  const auto words = parse_qos_profiles(
      "- history: keep_all\n  depth: 7\n  reliability: best_effort\n  durability: transient_local\n"
      "  deadline: {sec: 1, nsec: 2}\n  liveliness: manual_by_topic\n");
  ASSERT_TRUE(words.ok());
  EXPECT_EQ((*words)[0], profile);
  EXPECT_THAT(*parse_qos_profiles(""), IsEmpty());
  EXPECT_FALSE(parse_qos_profiles("- history: 17").ok());
  EXPECT_FALSE(parse_qos_profiles("{").ok());
  EXPECT_FALSE(parse_qos_profiles("text").ok());
}

}  // namespace
}  // namespace camvox::storage
