#include "camvox/recording/replay_component.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "camvox/storage/qos_profile.hpp"
#include "qos_overrides.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Progress;
using diagnostic_msgs::msg::DiagnosticArray;

constexpr std::int64_t kSecond_ns = 1'000'000'000;
/// After so long without a frame done, those under way are given up. A loop that is closed may take
/// minutes on a busy machine.
constexpr double kLongestSilence_s = 300.0;
constexpr std::chrono::milliseconds kLookPeriod{200};
/// How often in a row topics must be found connected, as the other side may see it a little later.
constexpr int kLooksConnected = 3;

std::string remapped(const std::string& topic, const std::vector<std::string>& rules) {
  for (const auto& rule : rules) {
    const auto separator = rule.find(":=");
    if (separator == std::string::npos) {
      throw std::runtime_error("remap '" + rule + "': must be from:=to");
    }
    if (rule.substr(0, separator) == topic) return rule.substr(separator + 2);
  }
  return topic;
}

/// What the recorded publishers offered, if they agree; else the default, as `ros2 bag play`.
Qos recorded_qos(const std::string& yaml) {
  const auto profiles = storage::parse_qos_profiles(yaml);
  if (!profiles.ok() || profiles->empty()) return qos::kDefault;
  Qos result = qos::kDefault;
  using Profile = storage::QosProfile;
  const auto& first = profiles->front();
  for (const auto& profile : *profiles) {
    if (profile.reliability != first.reliability || profile.durability != first.durability) {
      return qos::kDefault;
    }
  }
  result.reliable = first.reliability != Profile::Reliability::kBestEffort;
  result.latched = first.durability == Profile::Durability::kTransientLocal;
  return result;
}

/// `wanted`, or all topics, without /clock if we publish that ourselves.
std::vector<std::string> played_topics(const storage::BagReader& bag, const ReplayConfig& config) {
  auto names = config.topics;
  if (config.clock_hz <= 0.0) return names;
  if (names.empty()) {
    for (const auto& topic : bag.topics()) names.push_back(topic.name);
  }
  std::erase(names, topics::kClock);
  return names;
}

/// Capture stamp of a message that starts with std_msgs/Header: sec and nanosec behind the
/// encapsulation, little-endian as everything that is recorded here.
std::int64_t header_stamp_ns(const std::vector<std::uint8_t>& cdr) {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  if (cdr.size() < 12) return 0;
  std::memcpy(&sec, cdr.data() + 4, sizeof(sec));
  std::memcpy(&nanosec, cdr.data() + 8, sizeof(nanosec));
  return sec * kSecond_ns + nanosec;
}

}  // namespace

ReplayComponent::ReplayComponent(Context& context)
    : context_(context),
      config_(context.parameters<ReplayConfig>()),
      gate_(config_.lockstep ? config_.lockstep_components : std::vector<std::string>{},
            static_cast<std::size_t>(config_.frames_in_flight)),
      camera_time_offset_ns_(config_.camera_time_offset_ns) {
  if (config_.clock_hz > 0.0) {
    clock_ = context.advertise<rosgraph_msgs::msg::Clock>({"clock", topics::kClock},
                                                          {.qos = qos::kClock});
  }
  context.on_parameter_change<ReplayConfig>(
      config_, [this](const ReplayConfig& next) { change(next); }, {"rate", "paused"});
  if (!config_.lockstep && !config_.exit_at_end) return;
  const bool waits = config_.lockstep && !config_.lockstep_components.empty();
  context.subscribe<Progress>({"progress", topics::kProgress},
                              [this](const auto& progress) { add_progress(*progress); },
                              {.qos = qos::kKeyframes, .required = waits});
  if (!waits) return;
  context.subscribe<DiagnosticArray>({"diagnostics", topics::kDiagnostics},
                                     [this](const auto& health) { add_health(*health); },
                                     {.qos = qos::kDiagnostics, .required = false});
}

ReplayComponent::~ReplayComponent() = default;

void ReplayComponent::add_progress(const Progress& progress) {
  const auto& name = progress.component_name();
  const auto& header = progress.header();
  gate_.done(
      {name.data(), strnlen(name.data(), name.size())}, header.stamp_ns(), header.frame_id());
  if (player_) player_->poke();
  last_activity_ns_ = context_.now_ns();
  looks_held_ = 0;
}

/// Remembers which of the components that lockstep waits for have stopped.
void ReplayComponent::add_health(const DiagnosticArray& health) {
  for (const auto& status : health.status()) {
    for (const auto& name : config_.lockstep_components) {
      if (status.name() != status.hardware_id() + ": " + name) continue;
      const auto& values = status.values();
      const bool stopped = std::any_of(values.begin(), values.end(), [](const auto& value) {
        return value.key() == "state" && value.value() == "stopped";
      });
      stopped_.erase(name);
      if (stopped) stopped_[name] = status.message();
    }
  }
}

void ReplayComponent::change(const ReplayConfig& config) {
  config_ = config;
  if (!player_) return;
  player_->set_rate(config.rate);
  player_->set_paused(config.paused);
}

bool ReplayComponent::wait_for_acknowledgments(std::chrono::nanoseconds timeout) const {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + timeout;
  return std::all_of(publishers_.begin(), publishers_.end(), [&](const auto& publisher) {
    return publisher.wait_for_acknowledgments(
        std::max(deadline - Clock::now(), Clock::duration(0)));
  });
}

void ReplayComponent::start() {
  auto bag = storage::BagReader::open(config_.bag);
  if (!bag.ok()) {
    if (config_.exit_at_end) context_.request_exit();  // the others would wait for nothing
    throw std::runtime_error(bag.status().message());
  }
  for (const auto& problem : (*bag)->problems())
    context_.log().warn("{}", problem.status.message());
  advertise_topics(**bag);
  recording::PlayerOptions options;
  options.rate = config_.rate;
  options.as_fast_as_possible = config_.lockstep;
  options.loop = config_.loop;
  options.start_offset_s = config_.start_offset_s;
  if (config_.duration_s > 0.0) options.duration_s = config_.duration_s;
  options.start_paused = config_.paused;
  options.topics = played_topics(**bag, config_);
  options.read_ahead_bytes = static_cast<std::size_t>(config_.read_ahead_mb) << 20;
  options.read_ahead_messages = static_cast<std::size_t>(config_.read_ahead_messages);
  player_ = std::make_unique<recording::Player>(
      std::move(*bag),
      options,
      [this](recording::PlayedMessage&& message) { send(std::move(message)); },
      [this](const recording::PlayedMessage& message) {
        return !is_frame_[message.topic] || gate_.may_send();
      });
  if (config_.clock_hz > 0.0) {
    context_.every(std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / config_.clock_hz)),
                   [this] {
                     auto clock = clock_.loan();
                     const std::int64_t now_ns = player_->clock_ns();
                     clock->clock().sec(static_cast<std::int32_t>(now_ns / kSecond_ns));
                     clock->clock().nanosec(static_cast<std::uint32_t>(now_ns % kSecond_ns));
                     clock_.publish(std::move(clock));
                   });
  }
  context_.every(kLookPeriod, [this] {
    if (playing_) report();
    play_when_connected();
  });
  play_when_connected();
}

void ReplayComponent::play_when_connected() {
  if (playing_) return;
  const auto found =
      config_.wait_for_topics.empty() ? std::vector<TopicDescription>{} : context_.topics();
  for (const auto& name : config_.wait_for_topics) {
    const bool connected = std::any_of(found.begin(), found.end(), [&name](const auto& topic) {
      return topic.name == name && topic.publishers > 0 && topic.subscribers > 0;
    });
    if (connected) continue;
    if (!std::exchange(wait_reported_, true)) {
      context_.log().info("waits for the other side of {}", name);
    }
    looks_connected_ = 0;
    return;
  }
  if (!config_.wait_for_topics.empty() && ++looks_connected_ < kLooksConnected) return;
  playing_ = true;
  player_->start();
}

void ReplayComponent::advertise_topics(const storage::BagReader& bag) {
  const auto overrides = recording::read_qos_overrides(config_.qos_overrides);
  for (const auto& topic : bag.topics()) {
    const std::string name = remapped(topic.name, config_.remap);
    const auto override = overrides.find(topic.name);
    PublishOptions options{.qos = override == overrides.end()
                                      ? recorded_qos(topic.offered_qos_profiles)
                                      : override->second,
                           .max_loans = 2};
    if (!options.qos.reliable) best_effort_topics_.push_back(topic.name);
    // Messages leave on another thread, and 200 IMU samples may be handed over at once: a writer's
    // history of 5 or 10 would lose most of them. Of a latched topic the depth means something.
    if (override == overrides.end() && !options.qos.latched)
      options.qos.depth = std::max(options.qos.depth, recording::kQueuedMessages);
    publishers_.push_back(context_.advertise_raw({topic.name, name}, topic.type, options));
    const bool frames = topic.name == config_.lockstep_topic ||
                        topic.name == config_.lockstep_topic + "/compressed";
    is_frame_.push_back(config_.lockstep && frames);
  }
}

void ReplayComponent::send(recording::PlayedMessage&& message) {
  const bool is_frame = is_frame_[message.topic];
  const std::int64_t stamp_ns = header_stamp_ns(message.cdr) + camera_time_offset_ns_;
  if (is_frame) gate_.sent(stamp_ns);
  try {
    auto& publisher = publishers_[message.topic];
    auto loan = publisher.loan();
    loan->cdr = std::move(message.cdr);
    publisher.publish(std::move(loan));
  } catch (...) {
    if (is_frame) gate_.left_out(stamp_ns);
    throw;
  }
}

void ReplayComponent::report() {
  const auto state = player_->state();
  context_.diagnostics().set("sent", state.sent);
  context_.diagnostics().set("rate", state.rate);
  context_.diagnostics().set("refused", state.refused);
  if (state.refused > 0 && !std::exchange(refusal_reported_, true)) {
    context_.log().warn("a message was not sent: {} (more of them are only counted)",
                        state.refusal);
  }
  if (!state.finished) return check_lockstep(state);
  if (!end_reported_) return report_end(state);
  if (config_.exit_at_end) exit_when_done(state);
}

bool ReplayComponent::any_stopped(const std::vector<std::string>& names) const {
  return std::any_of(
      names.begin(), names.end(), [this](const auto& name) { return stopped_.contains(name); });
}

std::string ReplayComponent::with_reasons(std::vector<std::string> names) const {
  for (auto& name : names) {
    if (const auto found = stopped_.find(name); found != stopped_.end()) {
      name += " (" + found->second + ")";
    }
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Throws when the next frame waits for one that has stopped, or nothing has moved for very long.
void ReplayComponent::check_lockstep(const recording::PlayerState& state) {
  const bool moves = std::exchange(last_sent_, state.sent) != state.sent;
  if (moves || state.paused || gate_.may_send()) {
    looks_held_ = 0;
    return;
  }
  // Counted, not taken from a clock that may be set meanwhile.
  const double held_s = std::chrono::duration<double>(++looks_held_ * kLookPeriod).count();
  const auto missing = gate_.waits_for();
  if (held_s < (any_stopped(missing) ? config_.settle_s : kLongestSilence_s)) return;
  looks_held_ = 0;
  if (config_.exit_at_end) context_.request_exit();
  throw std::runtime_error(fmt::format(
      "for {:.0f} s no frame was done: lockstep waits for {}", held_s, with_reasons(missing)));
}

/// Time alone says little: a busy machine may take long for the last frames.
void ReplayComponent::exit_when_done(const recording::PlayerState& state) {
  const double silent_s = 1e-9 * static_cast<double>(context_.now_ns() - last_activity_ns_);
  if (silent_s < config_.settle_s || !context_.all_idle()) return;
  const auto behind = gate_.behind();
  if (!behind.empty() && !any_stopped(behind) && silent_s < kLongestSilence_s) return;
  context_.request_exit();
  if (!behind.empty()) {
    throw std::runtime_error(
        fmt::format("the last frames never got through {}", with_reasons(behind)));
  }
  if (!state.status.ok()) throw std::runtime_error(state.status.message());
}

void ReplayComponent::report_end(const recording::PlayerState& state) {
  end_reported_ = true;
  last_activity_ns_ = context_.now_ns();
  if (state.status.ok()) {
    const auto refused =
        state.refused > 0 ? fmt::format(", {} refused", state.refused) : std::string();
    context_.log().info("end of {}: {} messages sent{}", config_.bag, state.sent, refused);
    return;
  }
  // With exit_at_end the others first finish what they have got.
  if (!config_.exit_at_end) throw std::runtime_error(state.status.message());
  context_.diagnostics().report(HealthLevel::kError, state.status.message());
  context_.log().error("{}", state.status.message());
}

}  // namespace camvox
