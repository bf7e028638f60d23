#include "camvox/recording/record_component.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <stdexcept>

#include "qos_overrides.hpp"

namespace camvox {
namespace {

constexpr int kQueueDepth = 200;  // messages of one topic that wait for our thread

storage::BagWriterOptions writer_options(const RecordConfig& config) {
  storage::BagWriterOptions options;
  if (config.compression == "lz4") options.mcap.compression = storage::Compression::kLz4;
  if (config.compression == "zstd") options.mcap.compression = storage::Compression::kZstd;
  options.max_file_size = static_cast<std::uint64_t>(config.max_bag_size_mb * 1e6);
  options.max_file_duration_ns = static_cast<std::uint64_t>(config.max_bag_duration_s * 1e9);
  if (config.survive_power_cut) options.durability = storage::Durability::kPowerCut;
  return options;
}

std::regex parse_regex(const std::string& key, const std::string& text) {
  try {
    return std::regex(text);
  } catch (const std::regex_error& error) {
    throw config::ConfigError(
        {{{}, key, "'" + text + "' is no regular expression: " + error.what()}});
  }
}

bool contains(const std::vector<std::string>& list, const std::string& name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

}  // namespace

RecordComponent::RecordComponent(Context& context)
    : context_(context),
      config_(context.parameters<RecordConfig>()),
      regex_(parse_regex("regex", config_.regex)),
      exclude_regex_(parse_regex("exclude_regex", config_.exclude_regex)),
      qos_overrides_(recording::read_qos_overrides(config_.qos_overrides)) {}

RecordComponent::~RecordComponent() {
  const auto status = finish();
  if (!status.ok()) context_.log().error("{}", status.message());
}

void RecordComponent::stop() {
  const auto status = finish();
  recorder_.reset();  // the destructor has nothing to tell any more
  if (!status.ok()) throw std::runtime_error(status.message());
}

storage::Status RecordComponent::finish() {
  if (!recorder_) return {};
  return recorder_->close();
}

void RecordComponent::start() {
  auto bag = storage::BagWriter::create(config_.output, writer_options(config_));
  if (!bag.ok()) throw std::runtime_error(bag.status().message());
  recorder_ = std::make_unique<recording::Recorder>(
      std::move(*bag), static_cast<std::size_t>(config_.max_cache_mb) << 20);
  const auto period = std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(config_.polling_interval_s));
  context_.every(period, [this] { follow_topics(); });
  context_.every(std::chrono::seconds(1), [this] { report(); });
  follow_topics();
}

bool RecordComponent::wanted(const std::string& topic) const {
  if (contains(config_.exclude, topic) || std::regex_match(topic, exclude_regex_)) return false;
  if (config_.topics.empty() && config_.regex.empty()) return true;
  return contains(config_.topics, topic) || std::regex_match(topic, regex_);
}

std::uint64_t RecordComponent::lost() const {
  std::uint64_t lost = recorder_->state().dropped;
  for (const auto& [topic, subscription] : subscriptions_) {
    if (subscription) lost += subscription->stats().lost;
  }
  return lost;
}

void RecordComponent::follow_topics() {
  for (const auto& topic : context_.topics()) {
    if (topic.publishers == 0 || subscriptions_.contains(topic.name) || !wanted(topic.name)) {
      continue;
    }
    try {
      record(topic);
    } catch (const std::exception& error) {  // others may publish what they like by this name
      context_.log().error("{}: not recorded: {}", topic.name, error.what());
      subscriptions_[topic.name] = nullptr;  // told once
    }
  }
}

/// Demands what is offered, unless the file of overrides says otherwise.
Qos RecordComponent::qos_of(const TopicDescription& topic) {
  const auto override = qos_overrides_.find(topic.name);
  if (override == qos_overrides_.end()) {
    return {kQueueDepth, topic.offered.reliable, topic.offered.latched};
  }
  const auto& qos = override->second;
  if ((qos.reliable && !topic.offered.reliable) || (qos.latched && !topic.offered.latched)) {
    context_.log().warn("{}: the QoS override demands {}, but not all publishers offer it ({})",
                        topic.name,
                        interfaces::to_string(qos),
                        interfaces::to_string(topic.offered));
  }
  return qos;
}

void RecordComponent::record(const TopicDescription& topic) {
  // Subscribes first: if that is refused, the recording shall not list the topic.
  const auto number = std::make_shared<std::optional<std::size_t>>();
  const SubscribeOptions options{.qos = qos_of(topic), .required = false};
  subscriptions_[topic.name] = context_.subscribe_raw(
      {topic.name, topic.name},
      topic.type_name,
      [this, number](const Sample<RawMessage>& sample) {
        if (!*number) return;
        const auto bytes =
            std::shared_ptr<const std::vector<std::uint8_t>>(sample.message(), &sample->cdr);
        recorder_->write(**number, context_.now_ns(), sample.info().publish_stamp_ns, bytes);
      },
      options);
  const auto added = recorder_->add_topic(bag_topic(topic));
  if (!added.ok()) throw std::runtime_error(added.status().message());
  *number = *added;
  context_.log().info("recording {} ({})", topic.name, topic.type_name);
}

storage::BagTopic RecordComponent::bag_topic(const TopicDescription& topic) {
  const MessageType* type = interfaces::find_message_type(topic.type_name);
  storage::BagTopic entry;
  entry.name = topic.name;
  entry.type = topic.type_name;
  entry.offered_qos_profiles = interfaces::to_rosbag2_yaml(topic.offered);
  if (type != nullptr) {
    entry.schema = type->schema;
    entry.type_description_hash = type->type_hash;
  } else {
    context_.log().warn(
        "{}: the definition of {} is not known here; recorded without it, so most "
        "readers cannot decode it",
        topic.name,
        topic.type_name);
  }
  return entry;
}

void RecordComponent::report() {
  const auto state = recorder_->state();
  const std::uint64_t lost_messages = lost();
  context_.diagnostics().set("messages", state.written);
  context_.diagnostics().set("bytes", state.written_bytes);
  context_.diagnostics().set("lost", lost_messages);
  if (!state.status.ok() && !error_reported_) {
    error_reported_ = true;
    context_.diagnostics().report(HealthLevel::kError, state.status.message());
    context_.log().error("recording stopped: {}", state.status.message());
  } else if (lost_messages > 0 && state.status.ok()) {
    context_.diagnostics().report(HealthLevel::kWarn, "messages were lost");
  }
}

}  // namespace camvox
