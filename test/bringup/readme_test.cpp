#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "camvox/bringup/plugin_index.hpp"

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
