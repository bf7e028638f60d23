#include "camvox/bringup/probe.hpp"

#include <gmock/gmock.h>

namespace camvox::bringup {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kPoseSource = "  - {plugin: test::PoseSource, name: source}\n";
const std::string kPoseSink = "  - {plugin: test::PoseSink, name: sink}\n";

ProbedSystem probe(const std::string& text) {
  PluginLoader plugins(find_plugins({PLUGIN_PREFIX}));
  auto [config, problems] = parse_config(text, "rig.yaml");
  EXPECT_THAT(problems, IsEmpty());
  return probe_system(config, plugins);
}

std::vector<std::string> problems_of(const std::string& components) {
  std::vector<std::string> texts;
  for (const auto& problem : probe("components:\n" + components).problems) {
    texts.push_back(problem.to_string());
  }
  return texts;
}

TEST(Probe, CompleteSystemHasNoProblems) {
  EXPECT_THAT(problems_of(kPoseSource + kPoseSink), IsEmpty());
}

TEST(Probe, RecordsPortsWithTypesAndTopics) {
  const auto system = probe("components:\n" + kPoseSource +
                            "  - {plugin: test::PoseSink, name: sink, remap: {imu: /livox/imu}}\n");
  const auto& ports = system.components.at(1).ports;
  ASSERT_EQ(ports.size(), 3U);
  EXPECT_EQ(ports[0].type_name, "camvox_interfaces/msg/FramePose");
  EXPECT_TRUE(ports[0].internal && ports[0].required && !ports[0].is_output);
  EXPECT_FALSE(ports[1].required);
  EXPECT_EQ(ports[2].topic, "/livox/imu");
  EXPECT_FALSE(ports[2].internal);
}

TEST(Probe, ParameterProblemsNameFileLineAndKey) {
  EXPECT_THAT(
      problems_of(kPoseSource + R"(  - plugin: test::PoseSink
    name: sink
    parameters:
      limit_m: -1.0
      ransac: {count: 2.5, cuont: 1}
      mode: medium
)"),
      ElementsAre("rig.yaml:6: sink.parameters.limit_m: -1.0 must be greater than 0",
                  "rig.yaml:7: sink.parameters.ransac.count: expected integer, got double "
                  "2.5",
                  "rig.yaml:7: sink.parameters.ransac.cuont: unknown parameter (did you "
                  "mean 'ransac.count'?)",
                  "rig.yaml:8: sink.parameters.mode: \"medium\" must be one of fast, slow"));
}

TEST(Probe, ParametersAreAskedForByNameAndType) {
  const auto system =
      probe("components:\n" + kPoseSource +
            "  - {plugin: test::PoseSink, name: sink, parameters: {limit_m: 2.0}}\n");
  const auto& sink = system.components.at(1);
  EXPECT_EQ(sink.value<double>("limit_m"), 2.0);
  EXPECT_EQ(sink.value<std::int64_t>("ransac.count"), 3) << "the default";
  EXPECT_EQ(sink.value<std::string>("limit_m"), "");
  EXPECT_EQ(sink.value<bool>("unheard_of"), false);
}

TEST(Probe, ParametersOfAComponentWithoutAnyAreAnError) {
  EXPECT_THAT(problems_of("  - {plugin: test::PoseSource, name: source, parameters: {x: 1}}\n"),
              ElementsAre("rig.yaml:2: source.parameters.x: the component takes no parameters"));
}

TEST(Probe, UnknownPortNamesTheNearest) {
  EXPECT_THAT(problems_of(kPoseSource + "  - plugin: test::PoseSink\n    name: sink\n    remap:\n"
                                        "      extrinsic: /x\n      zzzzzzzzz: /y\n"),
              ElementsAre("rig.yaml:6: sink.remap.extrinsic: unknown port (did you mean "
                          "'extrinsics'?)",
                          "rig.yaml:7: sink.remap.zzzzzzzzz: unknown port (there are pose, "
                          "extrinsics, imu)"));
}

TEST(Probe, RequiredInternalInputNeedsAPublisher) {
  EXPECT_THAT(problems_of(kPoseSink),
              ElementsAre("rig.yaml:2: sink.remap.pose: nothing publishes /test/pose; add the "
                          "component that does, remap the port, or list the topic in "
                          "container.external_topics"));
  EXPECT_THAT(problems_of("  - plugin: test::PoseSource\n    name: source\n"
                          "    remap: {pose: /test/poses}\n" +
                          kPoseSink),
              ElementsAre(HasSubstr("did you mean '/test/poses'?")));
}

TEST(Probe, ExternalTopicNeedsNoPublisherHere) {
  EXPECT_THAT(
      probe("container: {external_topics: [/test/pose]}\ncomponents:\n" + kPoseSink).problems,
      IsEmpty());
  const auto both =
      probe("container: {external_topics: [/test/pose]}\ncomponents:\n" + kPoseSource).problems;
  ASSERT_EQ(both.size(), 1U);
  EXPECT_THAT(both[0].message, HasSubstr("external_topics, but published here"));
}

TEST(Probe, TwoPublishersOfAnInternalTopicAreAnError) {
  EXPECT_THAT(problems_of(kPoseSource + "  - {plugin: test::PoseSource, name: second}\n"),
              ElementsAre("rig.yaml:3: second.remap.pose: /test/pose is published by 'source' "
                          "already; an internal topic has one publisher"));
}

TEST(Probe, TwoPublishersOfAnEdgeTopicAreFine) {
  EXPECT_THAT(problems_of("  - {plugin: test::OdometrySource, name: a}\n"
                          "  - {plugin: test::OdometrySource, name: b}\n"),
              IsEmpty());
}

TEST(Probe, OneTopicWithTwoTypesIsAnError) {
  EXPECT_THAT(problems_of(kPoseSource + "  - plugin: test::OdometrySource\n    name: odometry\n" +
                          "    remap: {odometry: /test/pose}\n"),
              ElementsAre("rig.yaml:5: odometry.remap.odometry: /test/pose carries "
                          "nav_msgs/msg/Odometry here, but camvox_interfaces/msg/FramePose in "
                          "'source'"));
}

TEST(Probe, SettingsOfATopicThatNobodyUsesAreAnError) {
  const auto system =
      probe("topics:\n  /test/pos: {max_blocking_ms: 1}\ncomponents:\n" + kPoseSource);
  ASSERT_EQ(system.problems.size(), 1U);
  EXPECT_EQ(system.problems[0].to_string(),
            "rig.yaml:2: topics./test/pos: no component uses this topic (did you mean "
            "'/test/pose'?)");
}

TEST(Probe, ThrowingConstructorsAreReportedWhateverTheyThrow) {
  EXPECT_THAT(problems_of("  - name: a\n    plugin: test::ThrowingConstructor\n"
                          "  - name: b\n    plugin: test::ThrowingInt\n"),
              ElementsAre("rig.yaml:3: a.plugin: constructor threw an exception: the model file is "
                          "missing",
                          "rig.yaml:5: b.plugin: constructor threw an exception: exception of a "
                          "type that is not derived from std::exception"));
}

const std::string kReporters =
    "  - {plugin: test::FrameReporter, name: tracking}\n"
    "  - {plugin: test::KeyframeReporter, name: loop_closing}\n" +
    kPoseSource;

std::string lockstep_replay(const std::string& components) {
  return "  - {plugin: test::LockstepReplay, name: replay,\n"
         "     parameters: {lockstep: true, lockstep_components: " +
         components + "}}\n";
}

TEST(Probe, LockstepWaitsForWhoReportsEachFrame) {
  EXPECT_THAT(problems_of(kReporters + lockstep_replay("[tracking]")), IsEmpty());
}

TEST(Probe, LockstepThatWouldWaitForEverIsAnError) {
  EXPECT_THAT(
      problems_of(kReporters + lockstep_replay("[trackin, tracking, loop_closing, source]")),
      ElementsAre(
          "rig.yaml:6: replay.parameters.lockstep_components: 'trackin' is no component here (did "
          "you mean 'tracking'?), and /camvox/progress is not in container.external_topics",
          HasSubstr("'loop_closing' reports keyframes only, so that the replay would wait for "
                    "ever; leave it out"),
          HasSubstr("'source' does not report which frames are done")));
}

TEST(Probe, LockstepWaitsForAllWhoReportEachFrameUnlessTold) {
  const auto system = probe("components:\n" + kReporters +
                            "  - {plugin: test::FrameReporter, name: mapping}\n"
                            "  - {plugin: test::FrameReporter, name: elsewhere,\n"
                            "     remap: {progress: /other/progress}}\n"
                            "  - {plugin: test::LockstepReplay, name: replay,\n"
                            "     parameters: {lockstep: true}}\n");
  EXPECT_THAT(system.problems, IsEmpty());
  const std::vector<std::string> waited_for = {"tracking", "mapping"};
  EXPECT_EQ(system.components.back().effective_parameters.at("lockstep_components").value,
            config::Value(waited_for));
}

TEST(Probe, LockstepWithNobodyToWaitForIsAnError) {
  const std::string message =
      "replay.parameters.lockstep_components: lockstep has nobody to wait for: it would drop most "
      "frames";
  EXPECT_THAT(problems_of(kPoseSource + "  - {plugin: test::LockstepReplay, name: replay,\n"
                                        "     parameters: {lockstep: true}}\n"),
              ElementsAre("lockstep: " + message));
  EXPECT_THAT(problems_of(kReporters + lockstep_replay("[]")),
              ElementsAre("rig.yaml:6: " + message));
}

TEST(Probe, LockstepMayWaitForAnotherContainer) {
  EXPECT_THAT(probe("container: {external_topics: [/camvox/progress]}\ncomponents:\n" + kReporters +
                    lockstep_replay("[mapping]"))
                  .problems,
              IsEmpty());
}

/// A bag that is not there: all that is known of it is what the probing has seen.
TEST(Probe, LockstepLooksAtARecordingNoSecondTime) {
  ProbedSystem system;
  system.recordings["/no/such/bag"] = {"/imu", "/front/jpeg"};
  system.components.push_back(
      {"sync", {{"compressed_image", "/front/jpeg", "sensor_msgs/msg/CompressedImage"}}, {}, {}});
  ProbedComponent replay{
      "replay", {{"progress", "/camvox/progress", "camvox_interfaces/msg/Progress"}}, {}, {}};
  replay.effective_parameters["bag"] = {std::string("/no/such/bag"), {}};
  replay.effective_parameters["lockstep"] = {true, {}};
  ComponentConfig config;
  EXPECT_TRUE(give_lockstep_defaults(system, replay, config));
  EXPECT_EQ(config.parameters.at("lockstep_topic").value,
            config::Value(std::string("/front/jpeg")));

  replay.effective_parameters["lockstep_components"] = {std::vector<std::string>{"sync"}, {}};
  replay.effective_parameters["lockstep_topic"] = {std::string("/back/jpeg"), {"rig.yaml", 7}};
  system.components.push_back(replay);
  std::vector<std::string> texts;
  for (const auto& problem : check_lockstep({}, system)) texts.push_back(problem.to_string());
  EXPECT_THAT(texts,
              ::testing::Contains("rig.yaml:7: replay.parameters.lockstep_topic: no frames on "
                                  "/back/jpeg: /no/such/bag holds /imu, /front/jpeg"));
}

/// Reports come in lidar time: the replay must know what lies between that and an image's stamp.
TEST(Probe, LockstepNeedsTheTimeOffsetOfWhoReports) {
  const std::string reporter =
      "  - {plugin: test::FrameReporter, name: tracking,\n"
      "     parameters: {rig: {camera_time_offset_ns: -30}}}\n";
  EXPECT_THAT(
      problems_of(reporter + lockstep_replay("[tracking]")),
      ElementsAre(HasSubstr("replay.parameters.rig.camera_time_offset_ns: is 0, but -30 in "
                            "'tracking'; give `rig` to all, under `parameters:` of the file")));
  EXPECT_THAT(probe("parameters: {rig: {camera_time_offset_ns: -30}}\ncomponents:\n" + kReporters +
                    lockstep_replay("[tracking]"))
                  .problems,
              IsEmpty());
}

TEST(Probe, WithoutLockstepNobodyIsWaitedFor) {
  EXPECT_THAT(problems_of(kReporters + "  - {plugin: test::LockstepReplay, name: replay,\n"
                                       "     parameters: {lockstep_components: [loop_closing]}}\n"),
              IsEmpty());
}

TEST(Probe, PluginsThatCannotBeLoadedAreListedTogether) {
  const auto problems = problems_of(
      "  - {plugin: test::MissingLibrary, name: a}\n"
      "  - {plugin: test::Undefined, name: b}\n"
      "  - {plugin: test::NoSuchThing, name: c}\n" +
      kPoseSink);
  ASSERT_EQ(problems.size(), 3U) << "what they would publish is not known, so not missing";
  EXPECT_THAT(problems[0], HasSubstr("rig.yaml:2: a.plugin: plugin library"));
  EXPECT_THAT(problems[1], HasSubstr("rig.yaml:3: b.plugin: "));
  EXPECT_THAT(problems[1], HasSubstr("undefined symbol"));
  EXPECT_THAT(problems[2], HasSubstr("rig.yaml:4: c.plugin: no installed package offers"));
}

TEST(Probe, SharedParametersGoToComponentsThatHaveThem) {
  auto [config, problems] =
      parse_config("parameters: {limit_m: 4.0, ransac: {count: 9}}\ncomponents:\n" + kPoseSource +
                       "  - {plugin: test::PoseSink, name: sink, parameters: {limit_m: 2.0}}\n",
                   "rig.yaml",
                   {{"parameters.mode=slow"}, {}});
  EXPECT_THAT(problems, IsEmpty());
  PluginLoader plugins(find_plugins({PLUGIN_PREFIX}));
  const auto system = probe_system(config, plugins);
  EXPECT_THAT(system.problems, IsEmpty());
  const auto& parameters = system.components.at(1).effective_parameters;
  EXPECT_EQ(parameters.at("limit_m").value, config::Value(2.0)) << "its own wins";
  EXPECT_EQ(parameters.at("ransac.count").value, config::Value(std::int64_t{9}));
  EXPECT_EQ(parameters.at("ransac.count").location.to_string(), "rig.yaml:1");
  EXPECT_EQ(parameters.at("mode").value, config::Value(std::string("slow")));
}

TEST(Probe, AMistakeInSharedParametersIsSaidOnceWithAllWhoHaveIt) {
  const auto system =
      probe("parameters: {limit_m: -4.0}\ncomponents:\n" + kPoseSource + kPoseSink +
            "  - {plugin: test::PoseSink, name: second}\n"
            "  - {plugin: test::PoseSink, name: third, parameters: {limit_m: 2.0}}\n"
            "  - {plugin: test::PoseSink, name: fourth, parameters: {limit_m: -4.0}}\n");
  std::vector<std::string> texts;
  for (const auto& problem : system.problems) texts.push_back(problem.to_string());
  EXPECT_THAT(texts,
              ElementsAre("rig.yaml:1: parameters.limit_m: -4.0 must be greater than 0 (sink, "
                          "second)",
                          "rig.yaml:7: fourth.parameters.limit_m: -4.0 must be greater than 0"));
}

// As the check of a rig does, which knows nothing of the block's name in the config.
TEST(Probe, WhatAConstructorRefusesIsFoundWhereItWasGiven) {
  const auto system = probe(
      "parameters: {rig: {turn: 0.5}}\ncomponents:\n"
      "  - {plugin: test::CheckedTurn, name: a}\n"
      "  - {plugin: test::CheckedTurn, name: b}\n"
      "  - {plugin: test::CheckedTurn, name: c, parameters: {rig: {turn: 1.0}}}\n");
  ASSERT_EQ(system.problems.size(), 2U);
  EXPECT_EQ(system.problems[0].to_string(), "rig.yaml:1: parameters.rig.turn: must be 0 (a, b)");
  EXPECT_EQ(system.problems[1].to_string(), "rig.yaml:5: c.parameters.rig.turn: must be 0");
}

TEST(Probe, WhatARefusedComponentWouldPublishIsNotMissing) {
  EXPECT_THAT(
      problems_of("  - {plugin: test::CheckedTurn, name: a, parameters: {rig.turn: 1.0}}\n" +
                  kPoseSink),
      ElementsAre("rig.yaml:2: a.parameters.rig.turn: must be 0"));
}

TEST(Probe, SharedParametersThatNobodyHasAreAnError) {
  const auto system = probe("parameters: {limit: 4.0, ransac: {cuont: 9}, zzz: 1}\ncomponents:\n" +
                            kPoseSource + kPoseSink);
  std::vector<std::string> texts;
  for (const auto& problem : system.problems) texts.push_back(problem.to_string());
  EXPECT_THAT(texts,
              ElementsAre("rig.yaml:1: parameters.limit: no component has this parameter (did you "
                          "mean 'limit_m'?)",
                          "rig.yaml:1: parameters.ransac.cuont: no component has this parameter "
                          "(did you mean 'ransac.count'?)",
                          "rig.yaml:1: parameters.zzz: no component has this parameter"));
}

TEST(EffectiveConfig, ShowsDefaultsAndOriginsAndReadsBack) {
  const std::string text = "topics:\n  /test/pose: {max_blocking_ms: 7}\ncomponents:\n" +
                           kPoseSource +
                           "  - {plugin: test::PoseSink, name: sink, executor: two words,\n"
                           "     parameters: {limit_m: 2.0}}\n";
  PluginLoader plugins(find_plugins({PLUGIN_PREFIX}));
  auto config = parse_config(text, "rig.yaml").config;
  const auto effective = effective_config(config, probe_system(config, plugins).components);
  EXPECT_THAT(effective, HasSubstr("      limit_m: 2.0  # rig.yaml:6\n"));
  EXPECT_THAT(effective, HasSubstr("      ransac.count: 3  # default\n"));
  EXPECT_THAT(effective, HasSubstr("      imu: /imu  # in, sensor_msgs/msg/Imu\n"));
  EXPECT_THAT(effective, HasSubstr("  watchdog_s: 5.0\n"));

  auto again = parse_config(effective, "effective.yaml");
  EXPECT_THAT(again.problems, IsEmpty());
  const auto probed = probe_system(again.config, plugins);
  EXPECT_THAT(probed.problems, IsEmpty());
  EXPECT_EQ(again.config.components.at(1).executor, "two words");
  EXPECT_EQ(again.config.topics.at("/test/pose").max_blocking_ms, 7);
}

}  // namespace
}  // namespace camvox::bringup
