#include <chrono>
#include <thread>

#include "command_fixture.hpp"

// Ctrl-C while the container is busy with one of its components: the others, which have nothing to
// do with that, save their results all the same.
namespace camvox::bringup {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

class CommandStop : public CommandFixture {
 protected:
  /// Runs components that save into a folder of their own.
  void run_saving(const std::string& components) {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = write(test->name(), "") + ".d";
    std::filesystem::remove_all(folder_);
    run("container: {name: rig}\ncomponents:\n"
        "  - {plugin: test::Saver, name: results}\n" +
            components,
        {"--out", folder_});
  }
  [[nodiscard]] std::string saved_by(const std::string& name) const {
    std::ifstream file(std::filesystem::path(folder_) / name);
    return {std::istreambuf_iterator<char>(file), {}};
  }

 private:
  std::string folder_;
};

TEST_F(CommandStop, WhileAFailedComponentSaves) {
  run_saving(
      "  - {plugin: test::Saver, name: failed, parameters: {fail_after_s: 0.1, save_s: 3.0}}\n");
  ASSERT_TRUE(container_->wrote("[failed]: saves")) << container_->output();
  std::this_thread::sleep_for(500ms);  // longer than the container waits for its own thread
  EXPECT_EQ(stop(), 3);
  EXPECT_EQ(saved_by("results"), "saved") << container_->output();
  EXPECT_EQ(saved_by("failed"), "saved") << container_->output();
}

TEST_F(CommandStop, WhileAnUnloadedComponentSaves) {
  run_saving("  - {plugin: test::Saver, name: unloaded, parameters: {save_s: 3.0}}\n");
  const auto unload = begin({"component", "unload", "/rig", "2"});
  ASSERT_TRUE(container_->wrote("[unloaded]: saves")) << container_->output();
  std::this_thread::sleep_for(500ms);
  EXPECT_EQ(stop(), 3);
  EXPECT_EQ(saved_by("results"), "saved") << container_->output();
  EXPECT_EQ(saved_by("unloaded"), "saved") << container_->output();
}

TEST_F(CommandStop, WhileARestartedComponentHangsInItsConstructor) {
  run_saving(
      "  - {plugin: test::Saver, name: restarted, on_error: restart,\n"
      "     parameters: {fail_after_s: 0.1, hang_once_saved: true}}\n");
  ASSERT_TRUE(container_->wrote("[restarted]: hangs in its constructor")) << container_->output();
  std::this_thread::sleep_for(500ms);
  EXPECT_EQ(stop(), 3);
  EXPECT_EQ(saved_by("results"), "saved") << container_->output();
  EXPECT_THAT(container_->output(), HasSubstr("exits without restarted, which hangs"));
}

}  // namespace
}  // namespace camvox::bringup
