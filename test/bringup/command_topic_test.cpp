#include <chrono>
#include <regex>

#include "command_fixture.hpp"

namespace camvox::bringup {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kDemo = R"(container: {name: rig}
components:
  - plugin: camvox::SyntheticSourceComponent
    name: source
    parameters: {rate_hz: 50.0, width_px: 160, height_px: 120}
  - {plugin: camvox::SinkComponent, name: sink}
)";

class CommandTopic : public CommandFixture {
 protected:
  void SetUp() override { run(kDemo); }
  void TearDown() override { EXPECT_EQ(stop(), 0) << container_->output(); }
};

TEST_F(CommandTopic, ListShowsInternalAndEdgeTopics) {
  const auto list = command({"topic", "list"});
  EXPECT_EQ(list.exit_code, 0) << list.output;
  EXPECT_EQ(list.output, "/camvox/frame_image\n/diagnostics\n");
  const auto typed = command({"topic", "list", "-t"});
  EXPECT_THAT(typed.output, HasSubstr("/camvox/frame_image [camvox_interfaces/msg/FrameImage]\n"));
  EXPECT_THAT(typed.output, HasSubstr("/diagnostics [diagnostic_msgs/msg/DiagnosticArray]\n"));
  EXPECT_EQ(command({"topic", "list", "-c"}).output, "2\n");
}

TEST_F(CommandTopic, InfoAndType) {
  EXPECT_EQ(command({"topic", "type", "/diagnostics"}).output,
            "diagnostic_msgs/msg/DiagnosticArray\n");
  EXPECT_EQ(
      command({"topic", "info", "/diagnostics"}).output,
      "Type: diagnostic_msgs/msg/DiagnosticArray\nPublisher count: 1\nSubscription count: 0\n");
  const auto verbose = command({"topic", "info", "-v", "/diagnostics"});
  EXPECT_THAT(verbose.output, HasSubstr("Reliability: RELIABLE\n  Durability: VOLATILE"));
  EXPECT_THAT(verbose.output, HasSubstr("Participant: rig"));
}

TEST_F(CommandTopic, HzMeasuresTheRate) {
  const auto result = command({"topic", "hz", "/camvox/frame_image", "-n", "50"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  std::smatch rate;
  ASSERT_TRUE(
      std::regex_search(result.output, rate, std::regex("average rate: ([0-9.]+)\n\tmin: ")))
      << result.output;
  EXPECT_GT(std::stod(rate[1]), 25.0) << "a busy machine may drop some";
  EXPECT_LT(std::stod(rate[1]), 60.0);
}

TEST_F(CommandTopic, HzPrintsItsSummaryOnCtrlC) {
  const auto hz = begin({"topic", "hz", "/camvox/frame_image"});
  ASSERT_TRUE(hz->wrote("average rate: "));
  kill(hz->pid(), SIGINT);
  EXPECT_EQ(hz->wait(), 0);
  EXPECT_THAT(hz->output(), HasSubstr("window: "));
}

TEST_F(CommandTopic, BwMeasuresWhatCrossesTheProcess) {
  const auto result = command({"topic", "bw", "/camvox/frame_image", "-n", "20"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("/s from 20 messages"));
  EXPECT_THAT(result.output, HasSubstr("Message size mean: 19.2")) << "trimmed to the used part";
}

TEST_F(CommandTopic, DelayWorksForBothKindsOfHeader) {
  for (const std::string topic : {"/camvox/frame_image", "/diagnostics"}) {
    const auto result = command({"topic", "delay", topic, "-n", "2"});
    EXPECT_EQ(result.exit_code, 0) << result.output;
    std::smatch delay;
    ASSERT_TRUE(std::regex_search(result.output, delay, std::regex("average delay: (-?[0-9.]+)")))
        << result.output;
    EXPECT_GE(std::stod(delay[1]), 0.0);
    EXPECT_LT(std::stod(delay[1]), 1.0);
  }
}

TEST_F(CommandTopic, EchoPrintsYaml) {
  const auto image = command({"topic", "echo", "--once", "/camvox/frame_image", "-l", "4"});
  EXPECT_EQ(image.exit_code, 0) << image.output;
  EXPECT_THAT(image.output, HasSubstr("header:\n  stamp_ns: "));
  EXPECT_THAT(image.output, HasSubstr("\nwidth_px: 160\nheight_px: 120\n"));
  EXPECT_THAT(image.output, HasSubstr("'...'"));
  EXPECT_THAT(image.output, HasSubstr("\n---\n"));
  const auto health = command({"topic", "echo", "--once", "/diagnostics"});
  EXPECT_THAT(health.output, HasSubstr("header:\n  stamp:\n    sec: "));
  EXPECT_THAT(health.output, HasSubstr("status:\n- level: 0\n  name: 'rig: source'\n"));
  const auto field =
      command({"topic", "echo", "--once", "/camvox/frame_image", "--field", "width_px"});
  EXPECT_EQ(field.output, "160\n---\n");
  const auto wrong =
      command({"topic", "echo", "--once", "/camvox/frame_image", "--field", "widht"});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.output, HasSubstr("widht"));
}

TEST_F(CommandTopic, UnknownTopicsAreNamed) {
  for (const std::string verb : {"info", "type", "hz", "bw", "delay", "echo"}) {
    const auto result = command({"--timeout", "0.5", "topic", verb, "/no/such"});
    EXPECT_EQ(result.exit_code, 1) << verb;
    EXPECT_THAT(result.output, HasSubstr("/no/such")) << verb;
  }
  EXPECT_THAT(command({"topic", "hz", "no/slash"}).output, HasSubstr("must start with '/'"));
}

TEST_F(CommandTopic, ComponentsAreListedLoadedAndUnloaded) {
  EXPECT_EQ(command({"component", "list"}).output, "/rig\n  1  /source\n  2  /sink\n");
  EXPECT_EQ(command({"component", "list", "rig"}).output, "1  /source\n2  /sink\n");
  EXPECT_EQ(command({"component",
                     "load",
                     "/rig",
                     "camvox_test",
                     "test::Ticker",
                     "-n",
                     "late",
                     "-p",
                     "hang_s:=0.001",
                     "-r",
                     "ticks:=/late_ticks",
                     "-e",
                     "on_error:=ignore"})
                .output,
            "Loaded component 3 into '/rig' container node as '/late'\n");
  EXPECT_EQ(command({"param", "get", "/late", "hang_s"}).output, "Double value is: 0.001\n");
  EXPECT_THAT(command({"topic", "list"}).output, HasSubstr("/late_ticks\n"));
  const auto again =
      command({"component", "load", "/rig", "camvox_test", "test::Ticker", "-n", "late"});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.output, HasSubstr("there is a component 'late' already"));
  EXPECT_EQ(command({"component", "unload", "/rig", "3"}).output,
            "Unloaded component 3 from '/rig' container\n");
  const auto gone = command({"component", "unload", "/rig", "3"});
  EXPECT_EQ(gone.exit_code, 1);
  EXPECT_THAT(gone.output, HasSubstr("No node found with unique_id: 3"));
}

TEST_F(CommandTopic, ParametersAreListedReadSetAndDumped) {
  EXPECT_EQ(command({"param", "list", "/source"}).output,
            "/source:\n  height_px\n  rate_hz\n  width_px\n");
  EXPECT_EQ(command({"param", "list"}).output,
            "/sink:\n/source:\n  height_px\n  rate_hz\n  width_px\n");
  EXPECT_EQ(command({"param", "get", "/source", "width_px"}).output, "Integer value is: 160\n");
  EXPECT_EQ(command({"param", "get", "--hide-type", "/source", "rate_hz"}).output, "50.0\n");
  EXPECT_EQ(
      command({"param", "dump", "/source"}).output,
      "/source:\n  ros__parameters:\n    height_px: 120\n    rate_hz: 50.0\n    width_px: 160\n");
  const auto missing = command({"param", "get", "/source", "widht_px"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.output, HasSubstr("/source has no parameter 'widht_px'"));
  const auto fixed = command({"param", "set", "/source", "rate_hz", "10.0"});
  EXPECT_EQ(fixed.exit_code, 1);
  EXPECT_THAT(fixed.output, HasSubstr("fixed after start"));
  const auto nobody = command({"--timeout", "0.5", "param", "list", "/nobody"});
  EXPECT_EQ(nobody.exit_code, 1);
  EXPECT_THAT(nobody.output, HasSubstr("nobody serves /nobody/list_parameters"));
}

class CommandWithoutContainer : public CommandFixture {};

TEST_F(CommandWithoutContainer, AnswersQuicklyWithAClearError) {
  for (const auto& arguments :
       std::vector<std::vector<std::string>>{{"topic", "list"},
                                             {"topic", "hz", "/tf"},
                                             {"component", "list"},
                                             {"component", "unload", "/rig", "1"},
                                             {"param", "list"},
                                             {"param", "get", "/sync", "x"}}) {
    const auto begin = std::chrono::steady_clock::now();
    const auto result = command(arguments);
    EXPECT_EQ(result.exit_code, 1) << ::testing::PrintToString(arguments);
    EXPECT_THAT(result.output, HasSubstr("camvox: "));
    EXPECT_THAT(result.output, HasSubstr("domain"));
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 8s);
  }
}

TEST_F(CommandWithoutContainer, ComponentTypesNeedsNone) {
  const auto result = command({"component", "types"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.output, HasSubstr("camvox_components\n  camvox::SyntheticSourceComponent\n"));
  EXPECT_THAT(command({"component", "types", "camvox_test"}).output, HasSubstr("test::Ticker\n"));
  const auto none = command({"component", "types", "no_such_package"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.output, HasSubstr("no_such_package"));
}

}  // namespace
}  // namespace camvox::bringup
