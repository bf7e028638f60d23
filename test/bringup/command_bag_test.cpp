#include <chrono>
#include <regex>

#include "camvox/storage/bag_writer.hpp"
#include "camvox/test/deadline.hpp"
#include "command_fixture.hpp"

namespace camvox::bringup {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

const std::string kSource = R"(container: {name: rig}
components:
  - plugin: camvox::SyntheticSourceComponent
    name: source
    parameters: {rate_hz: 50.0, width_px: 160, height_px: 120}
)";

const std::string kSink = R"(container: {name: desk, external_topics: [/camvox/frame_image]}
components:
  - {plugin: camvox::SinkComponent, name: sink}
)";

class CommandBag : public CommandFixture {
 protected:
  CommandBag() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~CommandBag() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }

  /// Records the source's images until there are some in the file.
  void record(const std::string& bag, const std::vector<std::string>& more = {}) {
    run(kSource);
    std::vector<std::string> arguments = {"bag", "record", "-o", bag, "/camvox/frame_image"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto recorder = begin(arguments);
    ASSERT_TRUE(recorder->wrote("recording /camvox/frame_image")) << recorder->output();
    const fs::path file = fs::path(bag) / (fs::path(bag).filename().string() + "_0.mcap");
    ASSERT_TRUE(
        test::wait_until([&] { return fs::exists(file) && fs::file_size(file) > 100'000; }));
    kill(recorder->pid(), SIGINT);
    EXPECT_EQ(recorder->wait(), 0) << recorder->output();
    EXPECT_THAT(recorder->output(), HasSubstr(" 0 lost"));
    EXPECT_EQ(stop(), 0) << container_->output();
  }
  [[nodiscard]] std::uint64_t message_count(const std::string& bag) const {
    const auto info = command({"bag", "info", bag});
    EXPECT_EQ(info.exit_code, 0) << info.output;
    std::smatch count;
    EXPECT_TRUE(std::regex_search(info.output, count, std::regex("Messages: +([0-9]+)\n")));
    return std::stoull(count[1]);
  }

  fs::path folder_ = fs::path(::testing::TempDir()) / ("camvox_bag_" + std::to_string(getpid()));
};

TEST_F(CommandBag, RecordsInfoDoctorAndReplaysAnInternalTopic) {
  record(path("drive"));
  const auto info = command({"bag", "info", path("drive")});
  EXPECT_THAT(info.output, HasSubstr("Files:             drive_0.mcap\n"));
  EXPECT_THAT(info.output,
              HasSubstr("Topic information: Topic: /camvox/frame_image | Type: "
                        "camvox_interfaces/msg/FrameImage | Count: "));
  EXPECT_TRUE(fs::exists(path("drive") + "/metadata.yaml"));
  const auto doctor = command({"bag", "doctor", path("drive/drive_0.mcap")});
  EXPECT_EQ(doctor.exit_code, 0) << doctor.output;

  run(kSink);
  const auto played = command({"bag", "play", path("drive"), "--delay", "1", "--clock", "100"});
  EXPECT_EQ(played.exit_code, 0) << played.output;
  EXPECT_THAT(played.output, HasSubstr(" messages sent"));
  EXPECT_EQ(stop(), 0) << container_->output();
  EXPECT_THAT(container_->output(), HasSubstr("received     "));
}

TEST_F(CommandBag, ConvertKeepsEveryMessage) {
  record(path("drive"));
  const auto converted = command({"bag", "convert", "-i", path("drive"), "-o", path("small")});
  EXPECT_EQ(converted.exit_code, 0) << converted.output;
  EXPECT_EQ(message_count(path("small")), message_count(path("drive")));
  EXPECT_LT(fs::file_size(path("small/small_0.mcap")), fs::file_size(path("drive/drive_0.mcap")));
}

TEST_F(CommandBag, RecoverSavesWhatIsWholeAndSaysThatSomethingWasLost) {
  record(path("drive"));
  const auto file = path("drive/drive_0.mcap");
  fs::resize_file(file, fs::file_size(file) * 2 / 3);
  const auto recovered = command({"bag", "recover", file, "-o", path("saved.mcap")});
  EXPECT_EQ(recovered.exit_code, 3) << recovered.output;
  EXPECT_THAT(recovered.output, HasSubstr("something was lost"));
  EXPECT_GT(message_count(path("saved.mcap")), 0U);
  EXPECT_EQ(command({"bag", "recover", path("saved.mcap"), "-o", path("again.mcap")}).exit_code, 0);
}

TEST_F(CommandBag, PlayTakesTheOptionsOfRos2Bag) {
  record(path("drive"));
  const auto qos = write("qos.yaml",
                         "/camvox/frame_image: {history: keep_last, depth: 5, reliability: "
                         "best_effort, durability: volatile}\n");
  const auto storage = write("storage.yaml", "noChunkCRC: false\n");
  const auto played = command({"bag",
                               "play",
                               path("drive"),
                               "--rate",
                               "4",
                               "--qos-profile-overrides-path",
                               qos,
                               "--storage-config-file",
                               storage,
                               "--read-ahead-queue-size",
                               "3",
                               "--wait-for-all-acked",
                               "500",
                               "--disable-loan-message",
                               "--log-level",
                               "error"});
  EXPECT_EQ(played.exit_code, 0) << played.output;
  EXPECT_THAT(played.output, HasSubstr(" messages sent"));
  EXPECT_THAT(played.output, HasSubstr("/camvox/frame_image is best effort"));
  EXPECT_THAT(played.output, HasSubstr("noChunkCRC has no effect"));
  EXPECT_THAT(played.output, ::testing::Not(HasSubstr("end of ")));  // that is level info

  const auto bad = write("bad.yaml", "/a: {relability: reliable}\n");
  const auto refused = command({"bag", "play", path("drive"), "--qos-profile-overrides-path", bad});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.output, HasSubstr("bad.yaml:1: no such QoS policy: relability"));
  EXPECT_EQ(command({"bag", "play", path("drive"), "--log-level", "loud"}).exit_code, 2);
  EXPECT_EQ(command({"bag", "play", path("drive"), "--wait-for-all-acked", "-1"}).exit_code, 2);
  EXPECT_EQ(command({"bag", "play", path("drive"), "--read-ahead-queue-size", "0"}).exit_code, 2);
}

TEST_F(CommandBag, RecordSubscribesAsTheFileOfOverridesSays) {
  const auto qos = write("record_qos.yaml", "/camvox/frame_image: {reliability: best_effort}\n");
  run(kSource);
  const auto recorder = begin({"bag",
                               "record",
                               "-o",
                               path("drive"),
                               "/camvox/frame_image",
                               "--qos-profile-overrides-path",
                               qos});
  ASSERT_TRUE(recorder->wrote("recording /camvox/frame_image")) << recorder->output();
  std::string info;  // who asks may hear of the topic before it hears of the recorder
  EXPECT_TRUE(test::wait_until([&] {
    info = command({"topic", "info", "-v", "/camvox/frame_image"}).output;
    return info.find("Reliability: BEST_EFFORT") != std::string::npos;
  })) << info;
  kill(recorder->pid(), SIGINT);
  EXPECT_EQ(recorder->wait(), 0) << recorder->output();
  EXPECT_EQ(stop(), 0) << container_->output();

  const auto bad = write("bad_record.yaml", "/a: {relability: reliable}\n");
  const auto refused =
      command({"bag", "record", "-a", "-o", path("x"), "--qos-profile-overrides-path", bad});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.output, HasSubstr("bad_record.yaml:1: no such QoS policy: relability"));
  EXPECT_FALSE(fs::exists(path("x")));
}

TEST_F(CommandBag, CtrlCEndsAConversionWithoutATrace) {
  // 400 MB of messages: long enough to be interrupted, at any speed that a disk has.
  {
    auto writer = storage::BagWriter::create(path("big"));
    ASSERT_TRUE(writer.ok());
    storage::BagTopic topic;
    topic.name = "/a";
    topic.type = "test_msgs/msg/Bytes";
    topic.schema = "uint8[] data\n";
    const auto number = (*writer)->add_topic(topic);
    const std::vector<std::byte> data(4'000'000);
    for (std::int64_t i = 1; i <= 100; ++i) {
      ASSERT_TRUE((*writer)->write(*number, i, i, data).ok());
    }
    ASSERT_TRUE((*writer)->close().ok());
  }
  const auto process = begin(
      {"bag", "convert", "-i", path("big"), "-o", path("new"), "--compression-format", "zstd"});
  ASSERT_TRUE(test::wait_until([&] { return fs::exists(path("new")); }));
  kill(process->pid(), SIGINT);
  EXPECT_EQ(process->wait(), 130) << process->output();
  EXPECT_THAT(process->output(), HasSubstr("interrupted"));
  EXPECT_FALSE(fs::exists(path("new")));
}

TEST_F(CommandBag, SaysWhatIsWrong) {
  const auto missing = command({"bag", "info", path("no_such_bag")});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.output, HasSubstr("no_such_bag"));
  EXPECT_EQ(command({"bag", "play", path("no_such_bag")}).exit_code, 1);
  EXPECT_EQ(command({"bag", "record"}).exit_code, 1);
  EXPECT_EQ(command({"bag", "play", "x", "--rate", "-1"}).exit_code, 2);
  const auto exists = command({"bag", "record", "-a", "-o", folder_});
  EXPECT_EQ(exists.exit_code, 1) << exists.output;
  write("junk.mcap", "this is not MCAP");
  const auto junk = command({"bag", "doctor", write("junk.mcap", "this is not MCAP")});
  EXPECT_EQ(junk.exit_code, 1);
}

}  // namespace
}  // namespace camvox::bringup
