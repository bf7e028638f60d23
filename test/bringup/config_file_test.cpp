#include <gmock/gmock.h>

#include <fstream>

#include "camvox/bringup/system_config.hpp"

namespace camvox::bringup {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::string> problems_of(const std::string& text,
                                     const std::vector<std::string>& overrides = {}) {
  std::vector<std::string> texts;
  for (const auto& problem : parse_config(text, "rig.yaml", {overrides, {}}).problems) {
    texts.push_back(problem.to_string());
  }
  return texts;
}

config::Value value_of(const std::string& yaml) {
  const auto readout = parse_config(
      "components:\n  - plugin: a\n    name: b\n    parameters: {x: " + yaml + "}\n", "rig.yaml");
  EXPECT_THAT(readout.problems, IsEmpty()) << yaml;
  return readout.config.components.at(0).parameters.at("x").value;
}

TEST(ConfigFile, ReadsEverySection) {
  const auto readout = parse_config(R"(
container:
  name: rig
  domain_id: 7
  network: subnet
  transports: [udp]
  external_topics: [/camvox/map_update]
  watchdog_s: 2
topics:
  /camvox/cloud: {zero_copy: interprocess, max_blocking_ms: 5}
parameters:
  camera: {fx_px: 500.0}
components:
  - plugin: camvox::SyncComponent
    name: sync
    executor: front
    on_error: restart
    remap: {image: /camera/image_raw}
    parameters:
      gains: [1.0, 2.0]
      ransac: {iterations: 100}
  - plugin: camvox::DeskewComponent
    name: deskew
    watchdog_s: 0.5
)",
                                    "rig.yaml");
  ASSERT_THAT(readout.problems, IsEmpty());
  const auto& [container, shared, from_files, topics, locations, components] = readout.config;
  EXPECT_EQ(shared.at("camera.fx_px").value, config::Value(500.0));
  EXPECT_EQ(container.name, "rig");
  EXPECT_EQ(container.domain_id, 7);
  EXPECT_EQ(container.network, "subnet");
  EXPECT_THAT(container.transports, ElementsAre("udp"));
  EXPECT_THAT(container.external_topics, ElementsAre("/camvox/map_update"));
  EXPECT_EQ(topics.at("/camvox/cloud").zero_copy, "interprocess");
  EXPECT_EQ(topics.at("/camvox/cloud").max_blocking_ms, 5);
  ASSERT_EQ(components.size(), 2U);
  EXPECT_EQ(components[0].executor, "front");
  EXPECT_EQ(components[0].on_error, "restart");
  EXPECT_EQ(components[0].remap.at("image").topic, "/camera/image_raw");
  EXPECT_EQ(components[0].parameters.at("ransac.iterations").value,
            config::Value(std::int64_t{100}));
  EXPECT_EQ(components[0].watchdog_s, 2.0) << "inherited from the container";
  EXPECT_EQ(components[1].watchdog_s, 0.5);
}

TEST(ConfigFile, TypesScalarsByTheRulesOfRos) {
  EXPECT_EQ(value_of("1"), config::Value(std::int64_t{1}));
  EXPECT_EQ(value_of("-5"), config::Value(std::int64_t{-5}));
  EXPECT_EQ(value_of("0x10"), config::Value(std::int64_t{16}));
  EXPECT_EQ(value_of("1.0"), config::Value(1.0));
  EXPECT_EQ(value_of("1e3"), config::Value(1000.0));
  EXPECT_EQ(value_of(".inf"), config::Value(std::numeric_limits<double>::infinity()));
  EXPECT_EQ(value_of("true"), config::Value(true));
  EXPECT_EQ(value_of("\"true\""), config::Value(std::string("true")));
  EXPECT_EQ(value_of("'1'"), config::Value(std::string("1")));
  EXPECT_EQ(value_of("yes"), config::Value(std::string("yes")));
  EXPECT_EQ(value_of("1.2.3"), config::Value(std::string("1.2.3")));
  EXPECT_EQ(value_of("[1, 2]"), config::Value(std::vector<std::int64_t>{1, 2}));
  EXPECT_EQ(value_of("[true, false]"), config::Value(std::vector<bool>{true, false}));
  EXPECT_EQ(value_of("[a, b]"), config::Value(std::vector<std::string>{"a", "b"}));
}

TEST(ConfigFile, ReportsAllProblemsAtOnceWithTheirLines) {
  EXPECT_THAT(
      problems_of(R"(container:
  name: 1rig
  domain_id: 300
  netwrk: subnet
  transports: [udp, pigeon]
topcs:
  /x: {}
topics:
  camvox/cloud: {zero_copy: maybe}
  /camvox/cloud: {zero_copy: 5}
components:
  - plugin: camvox::SyncComponent
    name: sync
    on_eror: stop
    remap: {image: camera//image}
    parameters: {gains: [1, 2.0], deep: {x: }}
  - name: sync
    plugin: camvox::Other
    executor: 5
  - name: 'a b'
  - just text
)"),
      ElementsAre("rig.yaml:2: container.name: '1rig' must not start with a digit",
                  "rig.yaml:3: container.domain_id: 300 must be at most 232",
                  "rig.yaml:4: container.netwrk: unknown key (did you mean 'network'?)",
                  "rig.yaml:5: container.transports: [\"udp\", \"pigeon\"] must be one of "
                  "shared_memory, udp",
                  "rig.yaml:6: topcs: unknown section (did you mean 'topics'?)",
                  "rig.yaml:9: topics.camvox/cloud.zero_copy: \"maybe\" must be one of container, "
                  "interprocess",
                  "rig.yaml:9: topics.camvox/cloud: topic name 'camvox/cloud' must start with '/'",
                  "rig.yaml:10: topics./camvox/cloud.zero_copy: expected string, got integer 5",
                  "rig.yaml:14: sync.on_eror: unknown key (did you mean 'on_error'?)",
                  "rig.yaml:15: sync.remap.image: topic name 'camera//image' must start with '/'",
                  "rig.yaml:16: sync.parameters.gains: all values of a list must have one type "
                  "(write 1.0, not 1, among doubles)",
                  "rig.yaml:16: sync.parameters.deep.x: has no value",
                  "rig.yaml:17: sync.name: is the name of another component already (line 12)",
                  "rig.yaml:19: sync.executor: expected string, got integer 5",
                  "rig.yaml:20: a b: 'plugin' is missing",
                  "rig.yaml:20: a b.name: 'a b' may hold only letters, digits and '_'",
                  "rig.yaml:21: components[3]: expected 'plugin: ...' and 'name: ...'"));
}

TEST(ConfigFile, DuplicateKeysAreAnError) {
  EXPECT_THAT(problems_of("container:\n  name: a\n  name: b\n"),
              ElementsAre("rig.yaml:3: container.name: given twice (first in line 2)"));
  EXPECT_THAT(problems_of("components:\n  - plugin: a\n    name: b\n    parameters:\n"
                          "      a.b: 1\n      a: {b: 2}\n"),
              ElementsAre("rig.yaml:6: b.parameters.a.b: given twice"));
}

TEST(ConfigFile, BrokenYamlNamesTheLine) {
  const auto problems = problems_of("container:\n  name: [a\ncomponents: {\n");
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_THAT(problems[0], ::testing::MatchesRegex("rig.yaml:[34]: not valid YAML: .+"));
}

TEST(ConfigFile, OtherThanAMapIsAnError) {
  for (const std::string text : {"", "just text", "[1, 2]", "~"}) {
    EXPECT_THAT(problems_of(text),
                ElementsAre("rig.yaml:1: expected the sections container, topics, components"))
        << text;
  }
  EXPECT_THAT(problems_of("components: 5\n"),
              ElementsAre("rig.yaml:1: components: expected a list ('- plugin: ...')"));
  EXPECT_THAT(problems_of("container: [1]\n"),
              ElementsAre("rig.yaml:1: container: expected 'key: value' pairs"));
}

TEST(ConfigFile, IntegersBeyond64BitsAreRefused) {
  EXPECT_THAT(problems_of("container: {domain_id: 99999999999999999999}\n"),
              ElementsAre("rig.yaml:1: container.domain_id: 99999999999999999999 does not fit a "
                          "64-bit integer"));
}

TEST(ConfigFile, OverridesWinOverTheFile) {
  const std::string text = "components:\n  - {plugin: a, name: sync, parameters: {x: 1}}\n";
  const auto readout = parse_config(
      text,
      "rig.yaml",
      {{"sync.x=2.5", "sync.ransac.n=3", "sync.mode=slow", "container.domain_id=5"}, {}});
  EXPECT_THAT(readout.problems, IsEmpty());
  const auto& parameters = readout.config.components.at(0).parameters;
  EXPECT_EQ(parameters.at("x").value, config::Value(2.5));
  EXPECT_EQ(parameters.at("ransac.n").value, config::Value(std::int64_t{3}));
  EXPECT_EQ(parameters.at("mode").value, config::Value(std::string("slow")));
  EXPECT_EQ(readout.config.container.domain_id, 5);
}

TEST(ConfigFile, BadOverridesNameThemselves) {
  const std::string text = "components:\n  - {plugin: a, name: sync}\n";
  EXPECT_THAT(
      problems_of(text, {"sync", "snyc.x=1", "container.domain_id=-1", "sync.x=[1, a]"}),
      ElementsAre(
          "--set sync: expected component.parameter=value",
          "--set snyc.x=1: there is no component 'snyc' (there are container, parameters, sync)",
          "--set sync.x=[1, a]: all values of a list must have one type (write "
          "1.0, not 1, among doubles)",
          "--set container.domain_id=-1: container.domain_id: -1 must be at least "
          "0"));
}

TEST(ConfigFile, MissingFileIsNamed) {
  const auto missing = read_config_file("/no/such/rig.yaml");
  ASSERT_EQ(missing.problems.size(), 1U);
  EXPECT_EQ(missing.problems[0].to_string(), "/no/such/rig.yaml: there is no such file");
  const auto folder = read_config_file("/tmp");
  ASSERT_EQ(folder.problems.size(), 1U);
  EXPECT_EQ(folder.problems[0].to_string(), "/tmp: cannot be read, or is empty");
}

}  // namespace
}  // namespace camvox::bringup
