#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "camvox/storage/bag_writer.hpp"
#include "command_fixture.hpp"

namespace camvox::bringup {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;
using Clock = std::chrono::steady_clock;
using CommandRun = CommandFixture;

const std::string kTicker =
    "container: {name: rig}\ncomponents:\n"
    "  - {plugin: test::Ticker, name: ticker}\n";

TEST_F(CommandRun, StopsCleanlyOnBothSignals) {
  for (const int signal : {SIGINT, SIGTERM}) {
    run(kTicker);
    const auto begin = Clock::now();
    EXPECT_EQ(stop(signal), 0) << container_->output();
    EXPECT_LT(Clock::now() - begin, 2s);
    EXPECT_THAT(container_->output(), HasSubstr("[rig]: stopped"));
  }
}

TEST_F(CommandRun, PrintsTheEffectiveConfig) {
  run(kTicker, {"--set", "ticker.hang_s=0.001"});
  EXPECT_THAT(container_->output(), HasSubstr("hang_s: 0.001  # --set ticker.hang_s=0.001"));
  EXPECT_THAT(container_->output(), HasSubstr("fail_at: 0  # default"));
  EXPECT_THAT(container_->output(), HasSubstr(fmt::format("domain_id: {}\n", test::own_domain())))
      << "ROS_DOMAIN_ID wins over the file";
  EXPECT_EQ(stop(), 0);
}

TEST_F(CommandRun, HungComponentIsNamedAndDoesNotHoldUpTheExit) {
  run("components:\n  - {plugin: test::Ticker, name: stuck, watchdog_s: 0.1,\n"
      "     parameters: {hang_s: 60.0}}\n  - {plugin: test::Ticker, name: fine}\n");
  ASSERT_TRUE(container_->wrote("[stuck]: a callback has been running")) << container_->output();
  const auto begin = Clock::now();
  EXPECT_EQ(stop(), 3);
  EXPECT_LT(Clock::now() - begin, 2s);
  EXPECT_THAT(container_->output(), HasSubstr("[stuck]: hangs"));
  EXPECT_THAT(container_->output(), HasSubstr("exits without stuck, which hangs"));
}

std::string saved_by(const std::string& folder, const std::string& name) {
  std::ifstream file(std::filesystem::path(folder) / name);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST_F(CommandRun, SecondSignalExitsAtOnce) {
  run("components:\n  - {plugin: test::Saver, name: slow, parameters: {save_s: 60.0}}\n",
      {"--out", write("results", "") + ".second"});
  kill(container_->pid(), SIGINT);
  ASSERT_TRUE(container_->wrote("a second Ctrl-C ends without saving"));
  std::this_thread::sleep_for(1100ms);  // a person's second thought, not the same request again
  const auto begin = Clock::now();
  EXPECT_EQ(stop(), 130) << container_->output();
  EXPECT_LT(Clock::now() - begin, 2s);
  EXPECT_THAT(container_->output(), HasSubstr("ends without saving"));
}

// `timeout -s INT` signals the process and then its group.
TEST_F(CommandRun, TwoSignalsAtOnceAreOneRequest) {
  const auto folder = write("results", "") + ".twice";
  run("components:\n  - {plugin: test::Saver, name: slow, parameters: {save_s: 1.5}}\n",
      {"--out", folder});
  kill(container_->pid(), SIGINT);
  ASSERT_TRUE(container_->wrote("a second Ctrl-C ends without saving"));
  EXPECT_EQ(stop(), 0) << container_->output();
  EXPECT_EQ(saved_by(folder, "slow"), "saved");
}

// Saving may take longer than callbacks may, and one that fails or hangs keeps nobody else from it.
TEST_F(CommandRun, EveryComponentSavesItsResults) {
  const auto folder = write("results", "") + ".d";
  run("components:\n"
      "  - {plugin: test::Saver, name: slow, parameters: {save_s: 2.5}}\n"
      "  - {plugin: test::Saver, name: broken, parameters: {fail: true}}\n"
      "  - {plugin: test::Ticker, name: stuck, watchdog_s: 0.1, parameters: {hang_s: 60.0}}\n"
      "  - {plugin: test::Saver, name: last}\n",
      {"--out", folder});
  ASSERT_TRUE(container_->wrote("[stuck]: a callback has been running")) << container_->output();
  EXPECT_EQ(stop(), 3);
  EXPECT_EQ(saved_by(folder, "slow"), "saved");
  EXPECT_EQ(saved_by(folder, "last"), "saved");
  EXPECT_THAT(container_->output(), HasSubstr("[broken]: while stopping: disk full"));
  EXPECT_THAT(saved_by(folder, "config.yaml"), HasSubstr("plugin: test::Saver"));
}

TEST_F(CommandRun, SavingThatDoesNotEndIsCutOffAndNamed) {
  const auto folder = write("results", "") + ".d";
  run("container: {save_timeout_s: 0.5}\ncomponents:\n"
      "  - {plugin: test::Saver, name: endless, parameters: {save_s: 600.0}}\n",
      {"--out", folder, "--overwrite"});
  EXPECT_EQ(stop(), 3);
  EXPECT_THAT(container_->output(), HasSubstr("saving results of component 'endless'"));
}

TEST_F(CommandRun, ResultsAreNotOverwrittenUnasked) {
  const auto folder = std::filesystem::path(write("full", "")).parent_path();
  const auto result = command({"run", write("rig.yaml", kTicker), "--out", folder});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.output, HasSubstr("is not empty; choose another folder, or add --overwrite"));
}

/// A bag with a topic of compressed images, without messages.
std::string bag_of(const std::string& name, const std::string& images) {
  const auto bag = ::testing::TempDir() + std::to_string(getpid()) + "_" + name;
  std::filesystem::remove_all(bag);
  auto writer = storage::BagWriter::create(bag);
  EXPECT_TRUE(writer.ok()) << writer.status().message();
  storage::BagTopic topic;
  topic.name = images;
  topic.type = "sensor_msgs/msg/CompressedImage";
  EXPECT_TRUE((*writer)->add_topic(topic).ok());
  EXPECT_TRUE((*writer)->close().ok());
  return bag;
}

constexpr auto kLive =
    "components:\n"
    "  - {plugin: camvox::SyncComponent, name: sync, remap: {compressed_image: /front/jpeg}}\n";

TEST_F(CommandRun, OutputThatIsAFileIsRefusedAsSuch) {
  const auto file = write("file", "text");
  const auto result = command({"run", write("rig.yaml", kTicker), "--out", file, "--overwrite"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.output, HasSubstr("--out " + file + ": is a file, not a folder"));
  EXPECT_THAT(result.output, Not(HasSubstr("add --overwrite")));
}

TEST_F(CommandRun, AMapThatIsNotThereIsSaidBeforeAnythingIsWritten) {
  const auto folder = write("map", "") + ".out";
  const auto result =
      command({"run", "replay.yaml", "--out", folder, "--map", "/no/such/map.mcap"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.output, HasSubstr("--map /no/such/map.mcap: there is no such file"));
  EXPECT_FALSE(std::filesystem::exists(folder));
}

TEST_F(CommandRun, SaysWhatARecordingHoldsNothingFor) {
  const auto bag = bag_of("images", "/front/jpeg");
  const auto result = command({"run", write("live.yaml", kLive), "--bag", bag});
  EXPECT_THAT(result.output, HasSubstr("holds nothing for input 'lidar' of sync: no /livox/lidar"));
  EXPECT_THAT(result.output, Not(HasSubstr("nothing for input 'image'")));
  EXPECT_THAT(result.output,
              HasSubstr("nothing came on input 'image' (topic /camera/image_raw or /front/jpeg)"))
      << "it holds no message";
}

TEST_F(CommandRun, EndsWithTheBagThatItReplays) {
  const auto bag = write("empty", "") + ".bag";
  const auto output = write("empty", "") + ".out";
  std::filesystem::remove_all(bag);
  std::filesystem::remove_all(output);
  {
    auto writer = storage::BagWriter::create(bag);
    ASSERT_TRUE(writer.ok()) << writer.status().message();
    ASSERT_TRUE((*writer)->close().ok());
  }
  const auto result =
      command({"run", write("rig.yaml", kTicker), "--bag", bag, "--set", "ticker.hang_s=0.0"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("0 messages sent"));
}

TEST_F(CommandRun, EndsAtOnceWithoutTheBagThatItReplays) {
  const auto result = command({"run", write("rig.yaml", kTicker), "--bag", "/no/such/bag"});
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_THAT(result.output, HasSubstr("/no/such/bag"));
}

/// A bag of images that nobody can read, with these numbers of bytes and a stamp of their own each.
std::string write_bag(const std::string& folder, const std::vector<std::size_t>& sizes) {
  std::filesystem::remove_all(folder);
  auto writer = storage::BagWriter::create(folder);
  storage::BagTopic topic;
  topic.name = "/camera/image_raw";
  topic.type = "sensor_msgs/msg/Image";
  const auto number = (*writer)->add_topic(topic);
  std::int64_t time_ns = 0;
  for (const auto size : sizes) {
    time_ns += 100'000'000;
    std::vector<std::byte> cdr(size, std::byte{'x'});
    if (size > 4) cdr[4] = static_cast<std::byte>(time_ns / 100'000'000);
    EXPECT_TRUE((*writer)->write(*number, time_ns, time_ns, cdr).ok());
  }
  EXPECT_TRUE((*writer)->close().ok());
  return folder;
}

TEST_F(CommandRun, AMessageThatCannotBeSentCostsOnlyItself) {
  const auto bag = write_bag(write("gap", "") + ".bag", {16, 0, 16});
  const auto result = command({"run", write("rig.yaml", kTicker), "--bag", bag});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("2 messages sent, 1 refused"));
  EXPECT_THAT(result.output, HasSubstr("a message was not sent: sensor_msgs/msg/Image: invalid"));
}

TEST_F(CommandRun, ExitCodeTellsThatARecordingIsDamaged) {
  const auto bag = write_bag(write("damaged", "") + ".bag", {16});
  for (const auto& entry : std::filesystem::directory_iterator(bag)) {
    std::fstream file(entry.path(), std::ios::binary | std::ios::in | std::ios::out);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    const auto message = bytes.find("xxxx\1xxx");
    if (message == std::string::npos) continue;
    file.clear();
    file.seekp(static_cast<std::streamoff>(message)).put('y');
  }
  const auto result = command({"run", write("rig.yaml", kTicker), "--bag", bag});
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_THAT(result.output, HasSubstr("CRC"));
}

TEST_F(CommandRun, LockstepEndsWhenWhoItWaitsForHasStopped) {
  const auto bag = write_bag(write("held", "") + ".bag", {16, 16, 16});
  const auto result = command({"run",
                               write("rig.yaml",
                                     "components:\n"
                                     "  - {plugin: test::FrameReporter, name: reporter,\n"
                                     "     parameters: {fail: true}}\n"
                                     "  - {plugin: camvox::ReplayComponent, name: replay,\n"
                                     "     parameters: {bag: .,\n"
                                     "     lockstep: true, frames_in_flight: 1,\n"
                                     "     lockstep_components: [reporter]}}\n"),
                               "--bag",
                               bag});
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_THAT(result.output,
              HasSubstr("lockstep waits for reporter (stopped after an error: bad frame)"));
}

TEST_F(CommandRun, LockstepOfOneContainerRemindsOfTheOther) {
  run("container: {name: rig, external_topics: [/camvox/local_map, /camvox/map_update]}\n"
      "components:\n"
      "  - {plugin: test::FrameReporter, name: reporter}\n"
      "  - {plugin: test::LockstepReplay, name: replay}\n",
      {"--lockstep"});
  EXPECT_THAT(container_->output(),
              HasSubstr("--lockstep: the container that publishes /camvox/local_map, "
                        "/camvox/map_update must run with it, too"));
  EXPECT_EQ(stop(), 0) << container_->output();
}

TEST_F(CommandRun, LockstepCountsTheFramesThatSyncReads) {
  const auto bag = bag_of("front", "/front/jpeg");
  const auto print =
      command({"run", write("live.yaml", kLive), "--bag", bag, "--lockstep", "--print-config"});
  EXPECT_EQ(print.exit_code, 0) << print.output;
  EXPECT_THAT(print.output, HasSubstr("lockstep_topic: \"/front/jpeg\"  # lockstep"));
  EXPECT_THAT(print.output, HasSubstr("lockstep_components: [\"sync\"]  # lockstep"));
}

TEST_F(CommandRun, LockstepKnowsFramesThatReplayRenames) {
  const auto bag = bag_of("back", "/back/jpeg");
  const auto config = std::string(kLive) +
                      "  - {plugin: camvox::ReplayComponent, name: replay,\n"
                      "     parameters: {remap: [\"/back/jpeg:=/front/jpeg\"]}}\n";
  const auto print =
      command({"run", write("live.yaml", config), "--bag", bag, "--lockstep", "--print-config"});
  EXPECT_EQ(print.exit_code, 0) << print.output;
  EXPECT_THAT(print.output, HasSubstr("lockstep_topic: \"/back/jpeg\"  # lockstep"));
}

TEST_F(CommandRun, LockstepRefusesABagWithoutTheFrames) {
  const auto bag = bag_of("other", "/back/jpeg");
  const auto refused =
      command({"run", write("live.yaml", kLive), "--bag", bag, "--lockstep", "--check"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.output,
              HasSubstr("nothing recorded comes on /camera/image_raw or /front/jpeg, where images "
                        "are read: " +
                        bag + " holds /back/jpeg"));
  const auto wrong = command({"run",
                              write("live.yaml", kLive),
                              "--bag",
                              bag,
                              "--lockstep",
                              "--set",
                              "parameters.lockstep_topic=/back/jpg",
                              "--check"});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.output, HasSubstr("no frames on /back/jpg: " + bag + " holds /back/jpeg"));
}

TEST_F(CommandRun, LockstepMakesMappingWaitForLoops) {
  const auto print = command({"run", "camvox.yaml", "--lockstep", "--print-config"});
  EXPECT_EQ(print.exit_code, 0) << print.output;
  EXPECT_THAT(print.output, HasSubstr("wait_for_loop_closing: true  # --lockstep"));
  EXPECT_EQ(command({"run", "back_end.yaml", "--lockstep", "--check"}).exit_code, 0);
}

TEST_F(CommandRun, ParameterFilesServeEveryComponentThatHasTheParameter) {
  const auto rig = write("shared.yaml", "hang_s: 0.002\nunused_block: {x: 1}\n");
  const auto result =
      command({"run", write("rig.yaml", kTicker), "--print-config", "--parameters", rig});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("hang_s: 0.002  # " + rig + ":1"));
  const auto missing =
      command({"run", write("rig.yaml", kTicker), "--check", "--parameters", "/no/such.yaml"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.output, HasSubstr("/no/such.yaml: there is no such file"));
}

TEST_F(CommandRun, ExitCodeTellsThatAComponentHasFailed) {
  run("components:\n  - {plugin: test::Ticker, name: bad, parameters: {fail_at: 1}}\n");
  ASSERT_TRUE(container_->wrote("stops after an error: tick failed"));
  EXPECT_EQ(stop(), 3);
}

TEST_F(CommandRun, ListsAllProblemsAndStartsNothing) {
  const auto result = command({"run",
                               write("bad.yaml",
                                     "components:\n"
                                     "  - {plugin: test::PoseSink, name: a}\n"
                                     "  - {plugin: test::Nope, name: a}\n")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.output, HasSubstr("bad.yaml:3: a.name: is the name of another component"));
  EXPECT_THAT(result.output, HasSubstr("bad.yaml:3: a.plugin: no installed package offers"));
  EXPECT_THAT(result.output, HasSubstr("camvox: 2 problems in the config; nothing was started"));
  EXPECT_THAT(result.output, Not(HasSubstr("components on domain")));
}

TEST_F(CommandRun, CheckAndPrintConfigStartNothing) {
  const auto file = write("good.yaml", kTicker);
  const auto check = command({"run", file, "--check"});
  EXPECT_EQ(check.exit_code, 0);
  EXPECT_EQ(check.output, file + ": valid, 1 component\n");
  const auto print = command({"run", file, "--print-config"});
  EXPECT_EQ(print.exit_code, 0);
  EXPECT_THAT(print.output, ::testing::StartsWith("container:\n"));
  EXPECT_THAT(print.output, Not(HasSubstr("components on domain")));
}

TEST_F(CommandRun, OverridesWinOverTheEnvironment) {
  const auto file = write("domain.yaml", "container: {domain_id: 3}\ncomponents: []\n");
  const auto print = command({"run", file, "--print-config", "--set", "container.domain_id=5"});
  EXPECT_THAT(print.output, HasSubstr("domain_id: 5\n"));
}

TEST_F(CommandRun, InstalledConfigsAreFoundByName) {
  EXPECT_EQ(command({"run", "demo.yaml", "--check"}).exit_code, 0);
}

TEST_F(CommandRun, MissingConfigIsNamed) {
  const auto result = command({"run", "/no/such/rig.yaml"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.output, HasSubstr("/no/such/rig.yaml: there is no such file"));
}

TEST_F(CommandRun, WrongCommandLinesAreRefused) {
  for (const auto& arguments :
       std::vector<std::vector<std::string>>{{},
                                             {"fly"},
                                             {"run"},
                                             {"run", "a.yaml", "--chek"},
                                             {"topic"},
                                             {"topic", "hz"},
                                             {"param", "get", "/x"},
                                             {"component", "unload", "/x", "one"},
                                             {"topic", "list", "--domain", "500"}}) {
    const auto result = command(arguments);
    EXPECT_EQ(result.exit_code, 2) << ::testing::PrintToString(arguments);
    EXPECT_THAT(result.output, HasSubstr("camvox: "));
    EXPECT_THAT(result.output, HasSubstr("--help"));
  }
  EXPECT_THAT(command({"import", "kitti"}).output, HasSubstr("camvox: unknown: kitti"));
}

TEST_F(CommandRun, HelpNamesEveryWord) {
  const auto result = command({"--help"});
  EXPECT_EQ(result.exit_code, 0);
  for (const auto* word : {"run", "component", "topic", "param", "version"}) {
    EXPECT_THAT(result.output, HasSubstr(word));
  }
  EXPECT_THAT(command({"topic", "--help"}).output, HasSubstr("delay"));
  EXPECT_EQ(command({"version"}).output, "camvox 0.1.0\n");
}

}  // namespace
}  // namespace camvox::bringup
