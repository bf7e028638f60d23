#include "camvox/config/parameters.hpp"

#include <gmock/gmock.h>

#include <limits>

namespace camvox::config {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

struct InnerConfig {
  int iterations = 100;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("iterations", self.iterations, at_least(1), at_most(1000));
  }
};

struct OuterConfig {
  double max_range_m = 130.0;
  bool enabled = true;
  std::string mode = "fast";
  std::vector<double> gains = {1.0, 2.0};
  InnerConfig ransac;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("max_range_m", self.max_range_m, greater_than(0.0));
    field("enabled", self.enabled);
    field("mode", self.mode, one_of({"fast", "slow"}));
    field("gains", self.gains, at_least(0.0));
    field("ransac", self.ransac);
  }
};

Parameter at_line(int line, Value value) { return {std::move(value), {"rig.yaml", line}}; }

TEST(Parameters, LoadsEveryTypeAndNestedKeys) {
  OuterConfig config;
  const ParameterMap parameters = {{"max_range_m", at_line(1, 90.5)},
                                   {"enabled", at_line(2, false)},
                                   {"mode", at_line(3, std::string("slow"))},
                                   {"gains", at_line(4, std::vector<double>{0.5})},
                                   {"ransac.iterations", at_line(5, std::int64_t{7})}};
  EXPECT_THAT(load(parameters, config), IsEmpty());
  EXPECT_EQ(config.max_range_m, 90.5);
  EXPECT_FALSE(config.enabled);
  EXPECT_EQ(config.mode, "slow");
  EXPECT_THAT(config.gains, ElementsAre(0.5));
  EXPECT_EQ(config.ransac.iterations, 7);
}

TEST(Parameters, IntegerIsAcceptedForDoubleButNotTheOtherWayRound) {
  OuterConfig config;
  EXPECT_THAT(load({{"max_range_m", at_line(1, std::int64_t{90})}}, config), IsEmpty());
  EXPECT_EQ(config.max_range_m, 90.0);
  EXPECT_THAT(load({{"gains", at_line(1, std::vector<std::int64_t>{1, 2})}}, config), IsEmpty());
  const auto problems = load({{"ransac.iterations", at_line(9, 7.0)}}, config);
  ASSERT_THAT(problems, SizeIs(1));
  EXPECT_EQ(problems[0].to_string(),
            "rig.yaml:9: ransac.iterations: expected integer, got double 7.0");
  EXPECT_EQ(config.ransac.iterations, 100);
}

TEST(Parameters, ReportsAllProblemsAtOnceAndKeepsTheDefaults) {
  OuterConfig config;
  const auto problems = load({{"max_range_m", at_line(1, -1.0)},
                              {"mode", at_line(2, std::string("medium"))},
                              {"ransac.iteration", at_line(3, std::int64_t{5})},
                              {"gains", at_line(4, std::vector<double>{1.0, -2.0})}},
                             config);
  ASSERT_THAT(problems, SizeIs(4));
  const ConfigError error(problems);
  EXPECT_THAT(error.what(), HasSubstr("rig.yaml:1: max_range_m: -1.0 must be greater than 0"));
  EXPECT_THAT(error.what(), HasSubstr("rig.yaml:2: mode: \"medium\" must be one of fast, slow"));
  EXPECT_THAT(error.what(), HasSubstr("did you mean 'ransac.iterations'?"));
  EXPECT_THAT(error.what(), HasSubstr("rig.yaml:4: gains"));
  EXPECT_EQ(config.max_range_m, 130.0);
  EXPECT_EQ(config.mode, "fast");
}

TEST(Parameters, IntegerOutsideTheFieldIsRefused) {
  OuterConfig config;
  const auto problems = load({{"ransac.iterations", at_line(1, std::int64_t{1} << 40)}}, config);
  ASSERT_THAT(problems, SizeIs(1));
  EXPECT_THAT(problems[0].message, HasSubstr("out of range"));
}

TEST(Parameters, NanBreaksEveryNumericConstraint) {
  OuterConfig config;
  config.max_range_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(check(config), SizeIs(1));
  EXPECT_THROW(require_valid(config), ConfigError);
}

TEST(Parameters, DumpIsTheInverseOfLoad) {
  OuterConfig config;
  config.max_range_m = 42.0;
  config.gains = {3.0};
  config.ransac.iterations = 3;
  OuterConfig loaded;
  EXPECT_THAT(load(dump(config), loaded), IsEmpty());
  EXPECT_EQ(loaded.max_range_m, 42.0);
  EXPECT_THAT(loaded.gains, ElementsAre(3.0));
  EXPECT_EQ(loaded.ransac.iterations, 3);
}

TEST(Value, YamlTextKeepsTheType) {
  EXPECT_EQ(to_yaml(Value(1.0)), "1.0");
  EXPECT_EQ(to_yaml(Value(0.1)), "0.1");
  EXPECT_EQ(to_yaml(Value(1e-9)), "1e-09");
  EXPECT_EQ(to_yaml(Value(std::int64_t{3})), "3");
  EXPECT_EQ(to_yaml(Value(std::string("a\"b"))), "\"a\\\"b\"");
  EXPECT_EQ(to_yaml(Value(std::vector<bool>{true, false})), "[true, false]");
}

TEST(NearestName, IsSilentWhenNothingIsNear) {
  EXPECT_EQ(nearest_name("max_rnge_m", {"max_range_m", "mode"}), "max_range_m");
  EXPECT_EQ(nearest_name("max_range_m", {"max_range", "filter.max_range_m"}), "filter.max_range_m");
  EXPECT_EQ(nearest_name("filter.max_range_m", {"mode", "max_range_m"}), "max_range_m");
  EXPECT_EQ(nearest_name("zzzz", {"max_range_m", "mode"}), "");
}

TEST(ParameterText, NestsDottedKeys) {
  const auto at = [](Value value) { return Parameter{std::move(value), {}}; };
  const ParameterMap parameters = {{"a.b.c", at(std::int64_t{1})},
                                   {"a.b.d", at(2.0)},
                                   {"a.c", at(true)},
                                   {"a.d.e", at(std::string("x"))},
                                   {"b", at(std::vector<double>{1.0, 2.5})}};
  EXPECT_EQ(to_yaml(parameters),
            "a:\n  b:\n    c: 1\n    d: 2.0\n  c: true\n  d:\n    e: \"x\"\nb: [1.0, 2.5]\n");
  EXPECT_EQ(to_yaml(ParameterMap{}), "");
}

}  // namespace
}  // namespace camvox::config
