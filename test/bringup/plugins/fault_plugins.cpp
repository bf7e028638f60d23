// Components that misbehave when told to, for the life of a container.
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "camvox/component/component.hpp"
#include "camvox/interfaces/std_msgs.hpp"

namespace test {

using camvox::Context;
using std_msgs::msg::Header;

struct FaultConfig {
  std::int64_t fail_at = 0;  ///< Which tick throws; 0: none.
  std::string fault = "std";
  double hang_s = 0.0;  ///< How long every tick sleeps.
  bool fail_in_start = false;
  bool fail_now = false;  ///< Every tick throws.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("fail_at", self.fail_at, camvox::config::at_least(0));
    field("fault", self.fault, camvox::config::one_of({"std", "int"}));
    field("hang_s", self.hang_s, camvox::config::at_least(0.0));
    field("fail_in_start", self.fail_in_start);
    field("fail_now", self.fail_now);
  }
};

/// Ticks every 10 ms: counts in its diagnostics, publishes a header, and fails as configured.
class Ticker : public camvox::Component {
 public:
  explicit Ticker(Context& context)
      : context_(context),
        config_(context.parameters<FaultConfig>()),
        publisher_(context.advertise<Header>({"ticks", "/test/ticks"})) {
    if (const auto* earlier = std::any_cast<std::uint64_t>(context.restart_memory()))
      context.log().info("{} ticks before the error", *earlier);
    context.on_parameter_change<FaultConfig>(config_,
                                             [this](const FaultConfig& next) { config_ = next; });
    context.every(std::chrono::milliseconds(10), [this] { tick(); });
  }

  void start() override {
    if (config_.fail_in_start) throw std::runtime_error("cannot start");
  }

 private:
  void tick() {
    ++ticks_;
    context_.diagnostics().set("ticks", ticks_);
    if (auto* memory = context_.restart_memory()) *memory = ticks_;
    auto header = publisher_.loan();
    header->frame_id(context_.name());
    publisher_.publish(std::move(header));
    if (config_.hang_s > 0.0) {
      std::this_thread::sleep_for(std::chrono::duration<double>(config_.hang_s));
    }
    if (config_.fail_now || static_cast<std::int64_t>(ticks_) == config_.fail_at) {
      if (config_.fault == "int") throw 7;
      throw std::runtime_error("tick failed");
    }
  }

  Context& context_;
  FaultConfig config_;
  camvox::Publisher<Header> publisher_;
  std::uint64_t ticks_ = 0;
};

/// Parameters that are fixed after start; an array among them.
struct FixedConfig {
  std::vector<double> gains = {1.0, 2.5};
  int ransac_iterations = 100;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("gains", self.gains);
    field("ransac.iterations", self.ransac_iterations, camvox::config::at_least(1));
  }
};

class Fixed : public camvox::Component {
 public:
  explicit Fixed(Context& context) { (void)context.parameters<FixedConfig>(); }
};

struct SaverConfig {
  std::string output_dir;
  double save_s = 0.0;  ///< How long saving takes.
  bool fail = false;
  double fail_after_s = 0.0;     ///< When a callback throws; 0: never.
  bool hang_once_saved = false;  ///< The constructor does not return if there is a file already.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("output_dir", self.output_dir);
    field("save_s", self.save_s);
    field("fail", self.fail);
    field("fail_after_s", self.fail_after_s, camvox::config::at_least(0.0));
    field("hang_once_saved", self.hang_once_saved);
  }
};

/// Writes "<output_dir>/<name>" when it ends.
class Saver : public camvox::Component {
 public:
  explicit Saver(Context& context) : context_(context), config_(context.parameters<SaverConfig>()) {
    if (config_.hang_once_saved && std::filesystem::exists(file())) {
      context.log().info("hangs in its constructor");
      std::this_thread::sleep_for(std::chrono::minutes(10));
    }
    if (config_.fail_after_s == 0.0) return;
    context.every(std::chrono::duration_cast<std::chrono::nanoseconds>(
                      std::chrono::duration<double>(config_.fail_after_s)),
                  [] { throw std::runtime_error("failed"); });
  }

  void stop() override {
    if (config_.fail) throw std::runtime_error("disk full");
    context_.log().info("saves");
    std::this_thread::sleep_for(std::chrono::duration<double>(config_.save_s));
    std::ofstream(file()) << "saved";
  }

 private:
  [[nodiscard]] std::filesystem::path file() const {
    return std::filesystem::path(config_.output_dir) / context_.name();
  }

  Context& context_;
  SaverConfig config_;
};

}  // namespace test

CAMVOX_REGISTER_COMPONENT(test::Ticker)
CAMVOX_REGISTER_COMPONENT(test::Fixed)
CAMVOX_REGISTER_COMPONENT(test::Saver)
