// Components that differ only in what they ask for, for the checks before the start.
#include <chrono>
#include <stdexcept>

#include "camvox/component/component.hpp"
#include "camvox/component/progress.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/nav_msgs.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"

namespace test {

using camvox::Context;
using camvox_interfaces::msg::Extrinsics;
using camvox_interfaces::msg::FramePose;

/// Internal output "pose".
class PoseSource : public camvox::Component {
 public:
  explicit PoseSource(Context& context)
      : publisher_(context.advertise<FramePose>({"pose", "/test/pose"})) {}

 private:
  camvox::Publisher<FramePose> publisher_;
};

struct SinkConfig {
  double limit_m = 1.0;
  int count = 3;
  std::string mode = "fast";

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("limit_m", self.limit_m, camvox::config::greater_than(0.0));
    field("ransac.count", self.count, camvox::config::at_least(1));
    field("mode", self.mode, camvox::config::one_of({"fast", "slow"}));
  }
};

/// Required internal input "pose", optional internal input "extrinsics", edge input "imu".
class PoseSink : public camvox::Component {
 public:
  explicit PoseSink(Context& context) {
    (void)context.parameters<SinkConfig>();
    context.subscribe<FramePose>({"pose", "/test/pose"}, [](const auto&) {});
    context.subscribe<Extrinsics>(
        {"extrinsics", "/test/extrinsics"}, [](const auto&) {}, {.required = false});
    context.subscribe<sensor_msgs::msg::Imu>({"imu", "/imu"}, [](const auto&) {});
  }
};

/// Publishes an odometry where others expect a pose.
class OdometrySource : public camvox::Component {
 public:
  explicit OdometrySource(Context& context)
      : publisher_(context.advertise<nav_msgs::msg::Odometry>({"odometry", "/test/odometry"})) {}

 private:
  camvox::Publisher<nav_msgs::msg::Odometry> publisher_;
};

class ThrowingConstructor : public camvox::Component {
 public:
  explicit ThrowingConstructor(Context&) { throw std::runtime_error("the model file is missing"); }
};

class ThrowingInt : public camvox::Component {
 public:
  explicit ThrowingInt(Context&) { throw 42; }
};

struct TurnConfig {
  double turn = 0.0;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("rig.turn", self.turn);
  }
};

/// Refuses its only parameter, and calls it by half of its name.
class CheckedTurn : public camvox::Component {
 public:
  explicit CheckedTurn(Context& context) {
    if (context.parameters<TurnConfig>().turn == 0.0) return;
    throw camvox::config::ConfigError({{{}, "turn", "must be 0"}});
  }
};

struct ReporterConfig {
  bool fail = false;
  std::int64_t camera_time_offset_ns = 0;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("fail", self.fail);
    field("rig.camera_time_offset_ns", self.camera_time_offset_ns);
  }
};

/// Reports every frame, or fails soon.
class FrameReporter : public camvox::Component {
 public:
  explicit FrameReporter(Context& context) : progress_(context) {
    if (!context.parameters<ReporterConfig>().fail) return;
    context.every(std::chrono::milliseconds(100), [] { throw std::runtime_error("bad frame"); });
  }

 private:
  camvox::ProgressReporter progress_;
};

/// Reports keyframes.
class KeyframeReporter : public camvox::Component {
 public:
  explicit KeyframeReporter(Context& context)
      : progress_(context, camvox::ProgressReporter::kKeyframes) {}

 private:
  camvox::ProgressReporter progress_;
};

struct LockstepConfig {
  bool lockstep = false;
  std::vector<std::string> lockstep_components;
  std::int64_t camera_time_offset_ns = 0;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("lockstep", self.lockstep);
    field("lockstep_components", self.lockstep_components);
    field("rig.camera_time_offset_ns", self.camera_time_offset_ns);
  }
};

/// Waits for the reports of others.
class LockstepReplay : public camvox::Component {
 public:
  explicit LockstepReplay(Context& context) {
    (void)context.parameters<LockstepConfig>();
    context.subscribe<camvox_interfaces::msg::Progress>(
        {"progress", camvox::topics::kProgress}, [](const auto&) {}, {.required = false});
  }
};

}  // namespace test

CAMVOX_REGISTER_COMPONENT(test::PoseSource)
CAMVOX_REGISTER_COMPONENT(test::PoseSink)
CAMVOX_REGISTER_COMPONENT(test::OdometrySource)
CAMVOX_REGISTER_COMPONENT(test::FrameReporter)
CAMVOX_REGISTER_COMPONENT(test::KeyframeReporter)
CAMVOX_REGISTER_COMPONENT(test::LockstepReplay)
CAMVOX_REGISTER_COMPONENT(test::CheckedTurn)
CAMVOX_REGISTER_COMPONENT(test::ThrowingConstructor)
CAMVOX_REGISTER_COMPONENT(test::ThrowingInt)
