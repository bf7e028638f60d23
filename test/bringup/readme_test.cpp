#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "camvox/bringup/probe.hpp"

namespace camvox::bringup {
namespace {

std::string read(const std::filesystem::path& path) {
  std::ifstream stream(path);
  EXPECT_TRUE(stream) << path;
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

const std::filesystem::path kWorkspace = WORKSPACE;

TEST(Readme, ComponentExampleIsTheFileThatIsCompiled) {
  const auto example = read(kWorkspace / "components/examples/thumbnail.cpp");
  EXPECT_THAT(read(kWorkspace / "README.md"), ::testing::HasSubstr("```cpp\n" + example + "```"));
  const auto plugins = find_plugins();
  EXPECT_TRUE(std::any_of(plugins.begin(), plugins.end(), [](const auto& plugin) {
    return plugin.class_name == "ThumbnailComponent";
  }));
}

std::vector<std::string> code_blocks(const std::string& text, const std::string& language) {
  std::vector<std::string> blocks;
  const std::string fence = "```" + language + "\n";
  for (auto at = text.find(fence); at != std::string::npos; at = text.find(fence, at + 1)) {
    const auto begin = at + fence.size();
    blocks.push_back(text.substr(begin, text.find("```", begin) - begin));
  }
  return blocks;
}

TEST(Readme, ConfigsAreValid) {
  const auto blocks = code_blocks(read(kWorkspace / "README.md"), "yaml");
  EXPECT_GE(blocks.size(), 2U);
  PluginLoader plugins;
  for (const auto& block : blocks) {
    auto [config, problems] = parse_config(block, "README.md");
    const auto probed = probe_system(config, plugins);
    problems.insert(problems.end(), probed.problems.begin(), probed.problems.end());
    for (const auto& problem : problems) ADD_FAILURE() << problem.to_string();
  }
}

std::string without_code(std::string text) {
  for (auto begin = text.find("```"); begin != std::string::npos; begin = text.find("```")) {
    const auto end = text.find("```", begin + 3);
    text.erase(begin, end == std::string::npos ? end : end + 3 - begin);
  }
  return text;
}

/// Every relative link of the README leads to a file.
TEST(Readme, LinksLeadSomewhere) {
  const auto readme = without_code(read(kWorkspace / "README.md"));
  int links = 0;
  for (auto at = readme.find("]("); at != std::string::npos; at = readme.find("](", at + 1)) {
    const auto target = readme.substr(at + 2, readme.find(')', at) - at - 2);
    if (target.starts_with("http") || target.starts_with("#")) continue;
    EXPECT_TRUE(std::filesystem::exists(kWorkspace / target)) << target;
    ++links;
  }
  EXPECT_GT(links, 0);
}

}  // namespace
}  // namespace camvox::bringup
