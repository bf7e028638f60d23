#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "camvox/bringup/plugin_loader.hpp"

namespace camvox::bringup {
namespace {

using ::testing::HasSubstr;

std::string error_of(const std::string& class_name) {
  PluginLoader loader(find_plugins({PLUGIN_PREFIX}));
  try {
    (void)loader.factory(class_name);
  } catch (const PluginError& error) {
    return error.what();
  }
  return "no error";
}

TEST(PluginIndex, ListsClassesOfEveryPrefixOnce) {
  const auto plugins = find_plugins({PLUGIN_PREFIX, PLUGIN_PREFIX});
  const auto sinks = std::count_if(plugins.begin(), plugins.end(), [](const auto& plugin) {
    return plugin.class_name == "test::PoseSink";
  });
  EXPECT_EQ(sinks, 1);
  ASSERT_FALSE(plugins.empty());
  EXPECT_EQ(plugins[0].package, "camvox_test");
  EXPECT_EQ(plugins[0].library, std::string(PLUGIN_PREFIX) + "/lib/libwiring_plugins.so");
}

TEST(PluginIndex, FindsTheOwnInstallationWithoutAnyEnvironment) {
  for (const auto* name : {"AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "COLCON_PREFIX_PATH"}) {
    unsetenv(name);
  }
  const auto plugins = find_plugins();
  EXPECT_TRUE(std::any_of(plugins.begin(), plugins.end(), [](const auto& plugin) {
    return plugin.class_name == "camvox::SinkComponent" && std::filesystem::exists(plugin.library);
  }));
}

TEST(PluginIndex, MissingPrefixesAndJunkAreNoPlugins) {
  const auto prefix = std::filesystem::path(testing::TempDir()) / "junk_prefix";
  const auto index = prefix / "share/ament_index/resource_index/camvox_components";
  std::filesystem::create_directories(index);
  std::ofstream(index / "junk") << "\nno semicolon here\n\n";
  EXPECT_TRUE(find_plugins({"/no/such/prefix", prefix}).empty());
}

TEST(PluginLoader, MakesComponents) {
  PluginLoader loader(find_plugins({PLUGIN_PREFIX}));
  EXPECT_NE(loader.factory("test::PoseSource"), nullptr);
  EXPECT_NE(loader.factory("test::PoseSource"), nullptr) << "a second time";
}

TEST(PluginLoader, UnknownClassNamesTheNearest) {
  EXPECT_EQ(error_of("test::PoseSnk"),
            "no installed package offers 'test::PoseSnk' (did you mean 'test::PoseSink'?); 'camvox "
            "component types' lists what there is");
}

TEST(PluginLoader, WithoutAnyPluginSaysWhatToDo) {
  PluginLoader loader(std::vector<PluginEntry>{});
  EXPECT_THROW(
      {
        try {
          (void)loader.factory("a::B");
        } catch (const PluginError& error) {
          EXPECT_THAT(error.what(), HasSubstr("AMENT_PREFIX_PATH"));
          throw;
        }
      },
      PluginError);
}

TEST(PluginLoader, MissingLibraryIsNamed) {
  EXPECT_EQ(error_of("test::MissingLibrary"),
            std::string("plugin library ") + PLUGIN_PREFIX +
                "/lib/libno_such_library.so of package camvox_test does not exist; build and "
                "install the package again");
}

TEST(PluginLoader, UndefinedSymbolIsNamedAndDoesNotEndTheProcess) {
  const auto error = error_of("test::Undefined");
  EXPECT_THAT(error, HasSubstr("cannot be loaded"));
  EXPECT_THAT(error, HasSubstr("undefined symbol"));
  EXPECT_THAT(error, HasSubstr("function_of_a_missing_library"));
}

TEST(PluginLoader, ClassThatTheLibraryDoesNotHaveIsAnError) {
  const auto error = error_of("test::NotInLibrary");
  EXPECT_THAT(error, HasSubstr("does not export 'test::NotInLibrary'"));
  EXPECT_THAT(error, HasSubstr("test::PoseSink"));
}

TEST(Describe, KnowsEveryKindOfException) {
  EXPECT_EQ(describe(std::make_exception_ptr(std::runtime_error("x"))), "x");
  EXPECT_EQ(describe(std::make_exception_ptr(42)),
            "exception of a type that is not derived from std::exception");
}

}  // namespace
}  // namespace camvox::bringup
