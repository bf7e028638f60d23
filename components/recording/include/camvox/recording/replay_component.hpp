#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "camvox/component/component.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/diagnostic_msgs.hpp"
#include "camvox/interfaces/rosgraph_msgs.hpp"
#include "camvox/recording/lockstep_gate.hpp"
#include "camvox/recording/player.hpp"

namespace camvox {

/// Parameters of ReplayComponent.
struct ReplayConfig {
  std::string bag;              ///< A bag's folder, or one MCAP file.
  double rate = 1.0;            ///< Speed; 1 is that of the recording. May change while playing.
  bool loop = false;            ///< Starts again at the end.
  double start_offset_s = 0.0;  ///< Leaves out the first part.
  double duration_s = 0.0;      ///< Ends after so much of the recording; 0: with it.
  bool paused = false;          ///< Sends nothing. May change while playing.
  std::vector<std::string> topics;  ///< Only these; empty: all.
  std::vector<std::string> remap;   ///< "from:=to" each, as `ros2 bag play --remap`.
  double clock_hz = 0.0;            ///< Publishes /clock this often; 0: never.
  int read_ahead_mb = 256;          ///< Bound of what is read ahead.
  int read_ahead_messages = 0;      ///< The same in messages; 0: no bound.
  std::string qos_overrides;        ///< YAML file of QoS by topic, as `ros2 bag play` takes it.
  bool lockstep = false;            ///< As fast as all listed components keep up, nothing dropped.
  std::string lockstep_topic = "/camera/image_raw";  ///< Or compressed: the frames.
  std::vector<std::string> lockstep_components;      ///< Who reports each frame done.
  int frames_in_flight = 2;  ///< Frames sent before the first of them must be done.
  /// What sync adds to an image's stamp: it reports frames in lidar time. For lockstep.
  std::int64_t camera_time_offset_ns = 0;
  /// Starts when each of these topics has a publisher and a subscriber, one of them in another
  /// process: a back end that is not there yet would miss the first frames.
  std::vector<std::string> wait_for_topics;
  /// Ends the container when the recording is over, no component has anything left to do, and in
  /// lockstep the last frame is done.
  bool exit_at_end = false;
  double settle_s = 2.0;  ///< And nothing has been reported done for so long, for other processes.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("bag", self.bag, config::not_empty());
    field("rate", self.rate, config::greater_than(0.0));
    field("loop", self.loop);
    field("start_offset_s", self.start_offset_s, config::at_least(0.0));
    field("duration_s", self.duration_s, config::at_least(0.0));
    field("paused", self.paused);
    field("topics", self.topics);
    field("remap", self.remap);
    field("clock_hz", self.clock_hz, config::at_least(0.0), config::at_most(1000.0));
    field("read_ahead_mb", self.read_ahead_mb, config::at_least(1));
    field("read_ahead_messages", self.read_ahead_messages, config::at_least(0));
    field("qos_overrides", self.qos_overrides);
    field("lockstep", self.lockstep);
    field("lockstep_topic", self.lockstep_topic);
    field("lockstep_components", self.lockstep_components);
    field("frames_in_flight", self.frames_in_flight, config::at_least(1));
    field("rig.camera_time_offset_ns", self.camera_time_offset_ns);
    field("wait_for_topics", self.wait_for_topics);
    field("exit_at_end", self.exit_at_end);
    field("settle_s", self.settle_s, config::at_least(0.0), config::at_most(3600.0));
  }
};

/// Publishes a recording. Bytes go out as they were recorded, whatever their type; internal topics
/// are decoded once, into loaned samples, by the container. With `lockstep` the next frame is sent
/// when the named components have reported the earlier one on /camvox/progress. When one of them
/// has stopped, or none has reported anything for five minutes, the replay fails and names them.
class ReplayComponent final : public Component {
 public:
  explicit ReplayComponent(Context& context);
  ~ReplayComponent() override;
  void start() override;
  /// Pause, rate and progress; only after `start`.
  [[nodiscard]] recording::Player& player() { return *player_; }
  /// Waits until all reliable readers have all messages; false at the timeout.
  [[nodiscard]] bool wait_for_acknowledgments(std::chrono::nanoseconds timeout) const;
  /// Topics whose readers acknowledge nothing.
  [[nodiscard]] const std::vector<std::string>& best_effort_topics() const {
    return best_effort_topics_;
  }

 private:
  void change(const ReplayConfig& config);
  void advertise_topics(const storage::BagReader& bag);
  void send(recording::PlayedMessage&& message);
  void play_when_connected();
  void add_progress(const camvox_interfaces::msg::Progress& progress);
  void add_health(const diagnostic_msgs::msg::DiagnosticArray& health);
  [[nodiscard]] bool any_stopped(const std::vector<std::string>& names) const;
  [[nodiscard]] std::string with_reasons(std::vector<std::string> names) const;
  void report();
  void check_lockstep(const recording::PlayerState& state);
  void report_end(const recording::PlayerState& state);
  void exit_when_done(const recording::PlayerState& state);

  Context& context_;
  ReplayConfig config_;
  recording::LockstepGate gate_;
  std::int64_t camera_time_offset_ns_;          // as config_, which the player's thread may not see
  std::map<std::string, std::string> stopped_;  // of those that lockstep waits for; why
  std::uint64_t last_sent_ = 0;
  int looks_held_ = 0;  // in a row at which lockstep held the next frame and nothing moved
  bool refusal_reported_ = false;
  Publisher<rosgraph_msgs::msg::Clock> clock_;
  std::vector<Publisher<RawMessage>> publishers_;  // by number of the bag's topic
  std::vector<bool> is_frame_;                     // same
  std::vector<std::string> best_effort_topics_;
  std::unique_ptr<recording::Player> player_;
  bool playing_ = false;
  bool wait_reported_ = false;
  int looks_connected_ = 0;  // in a row at which all of wait_for_topics were connected
  bool end_reported_ = false;
  std::int64_t last_activity_ns_ = 0;  // when the end was reached, or a frame reported done
};

}  // namespace camvox
