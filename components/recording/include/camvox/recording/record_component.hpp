#pragma once

#include <map>
#include <memory>
#include <regex>
#include <string>
#include <vector>

#include "camvox/component/component.hpp"
#include "camvox/recording/recorder.hpp"

namespace camvox {

/// Parameters of RecordComponent.
struct RecordConfig {
  std::string output;                ///< Folder to make; must not exist yet.
  std::vector<std::string> topics;   ///< Only these; empty: all that are published.
  std::vector<std::string> exclude;  ///< Not these.
  std::string regex;                 ///< Also those whose whole name matches; "": none.
  std::string exclude_regex;         ///< Not those whose whole name matches.
  std::string compression = "none";  ///< none, lz4 or zstd.
  double max_bag_size_mb = 0.0;      ///< Goes on in a new file at this size; 0: never.
  double max_bag_duration_s = 0.0;   ///< Goes on in a new file after this time; 0: never.
  int max_cache_mb = 256;            ///< Bound of what waits for the disk.
  /// Waits for the disk after each chunk, so that a power cut loses no more than the open one.
  bool survive_power_cut = true;
  double polling_interval_s = 0.1;  ///< How often to look for new topics.
  std::string qos_overrides;        ///< YAML file of QoS by topic, as `ros2 bag record` takes it.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("output", self.output, config::not_empty());
    field("topics", self.topics);
    field("exclude", self.exclude);
    field("regex", self.regex);
    field("exclude_regex", self.exclude_regex);
    field("compression", self.compression, config::one_of({"none", "lz4", "zstd"}));
    field("max_bag_size_mb", self.max_bag_size_mb, config::at_least(0.0));
    field("max_bag_duration_s", self.max_bag_duration_s, config::at_least(0.0));
    field("max_cache_mb", self.max_cache_mb, config::at_least(1));
    field("survive_power_cut", self.survive_power_cut);
    field("polling_interval_s", self.polling_interval_s, config::at_least(0.01));
    field("qos_overrides", self.qos_overrides);
  }
};

/// Records any topics to MCAP, as `ros2 bag record -s mcap` does. Internal topics are recorded as
/// the ROS 2 messages that other processes see.
class RecordComponent final : public Component {
 public:
  explicit RecordComponent(Context& context);
  ~RecordComponent() override;
  void start() override;
  /// Throws if not all that came could be saved; a run then ends with exit code 3.
  void stop() override;
  /// Writes what waits and closes the recording; tells what came of it.
  storage::Status finish();
  [[nodiscard]] recording::RecorderState state() const { return recorder_->state(); }
  /// Messages that were sent while recording but are not in it.
  [[nodiscard]] std::uint64_t lost() const;

 private:
  void follow_topics();
  void record(const TopicDescription& topic);
  [[nodiscard]] storage::BagTopic bag_topic(const TopicDescription& topic);
  void report();
  [[nodiscard]] bool wanted(const std::string& topic) const;
  [[nodiscard]] Qos qos_of(const TopicDescription& topic);

  Context& context_;
  RecordConfig config_;
  std::regex regex_;
  std::regex exclude_regex_;
  std::map<std::string, Qos> qos_overrides_;
  std::map<std::string, Subscription> subscriptions_;
  std::unique_ptr<recording::Recorder> recorder_;
  bool error_reported_ = false;
};

}  // namespace camvox
