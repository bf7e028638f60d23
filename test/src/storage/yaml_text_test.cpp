#include "camvox/storage/yaml_text.hpp"

#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

namespace camvox::storage {
namespace {

TEST(YamlText, QuotesOnlyWhatNeedsIt) {
  EXPECT_EQ(yaml_string("/livox/imu"), "/livox/imu");
  EXPECT_EQ(yaml_string("base_link"), "base_link");
  EXPECT_EQ(yaml_string(""), "''");
  EXPECT_EQ(yaml_string("12"), "'12'");
  EXPECT_EQ(yaml_string("Yes"), "'Yes'");
  EXPECT_EQ(yaml_string("a: b"), "'a: b'");
  EXPECT_EQ(yaml_string("it's"), "'it''s'");
  EXPECT_EQ(yaml_string("a\nb"), "\"a\\nb\"");
}

TEST(YamlText, EveryStringComesBackThroughAYamlParser) {
  for (const std::string text :
       {"",   " ",    "x ",    "- a",     "#c",          "~",   "null", "0x10",  "1e5", "a#b",
        "é",  "日本", "tab\t", "quote\"", "back\\slash", "[x]", "{y}",  "&z",    "*w",  "!t",
        "%d", "@e",   "`f",    "|",       ">",           "?",   ":",    "a\nb\n"}) {
    EXPECT_EQ(YAML::Load(yaml_string(text)).as<std::string>(), text);
    EXPECT_EQ(YAML::Load(yaml_quoted(text)).as<std::string>(), text);
  }
}

TEST(YamlText, BytesThatAreNotUtf8AreEscaped) {
  EXPECT_EQ(yaml_string("\xff\x01"), "\"\\xff\\x01\"");
  EXPECT_EQ(yaml_string("\xc3"), "\"\\xc3\"");
}

}  // namespace
}  // namespace camvox::storage
