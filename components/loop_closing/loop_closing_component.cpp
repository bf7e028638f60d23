#include "camvox/loop_closing/loop_closing_component.hpp"

#include <chrono>
#include <exception>
#include <utility>

#include "camvox/conversion/map_messages.hpp"
#include "camvox/loop_closing/messages.hpp"

namespace camvox {
namespace {

/// Keyframes or map updates that wait for each other at most. In lockstep nothing is lost, so
/// waiting ends by itself.
constexpr std::size_t kPatience = 8;
constexpr std::size_t kPatienceLockstep = 256;

LoopClosingComponentConfig checked(LoopClosingComponentConfig config) {
  auto problems = sensors::check(config.camera);
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
  return config;
}

camvox_interfaces::msg::MessageHeader header_of(const tracking::Keyframe& keyframe) {
  camvox_interfaces::msg::MessageHeader header;
  header.stamp_ns(keyframe.stamp_ns);
  header.frame_id(keyframe.frame_id);
  return header;
}

}  // namespace

LoopClosingComponent::LoopClosingComponent(Context& context)
    : context_(context),
      config_(checked(context.parameters<LoopClosingComponentConfig>())),
      camera_{
          config_.camera.fx_px, config_.camera.fy_px, config_.camera.cx_px, config_.camera.cy_px},
      closer_(config_.loop),
      order_(config_.lockstep ? kPatienceLockstep : kPatience),
      progress_(context, ProgressReporter::kKeyframes),
      corrections_(context.advertise<LoopCorrection>({"loop_correction", topics::kLoopCorrection},
                                                     {.qos = qos::kKeyframes})),
      answers_(context.advertise<RelocalisationAnswer>(
          {"relocalisation_answer", topics::kRelocalisationAnswer}, {.qos = qos::kKeyframes})) {
  context.subscribe<Keyframe>({"keyframe", topics::kKeyframe},
                              [this](const auto& keyframe) { on_keyframe(*keyframe); },
                              {.qos = qos::kKeyframes});
  context.subscribe<Keyframe>({"resent_keyframe", topics::kResentKeyframe},
                              [this](const auto& keyframe) {
                                resent_.insert(keyframe->id());
                                on_keyframe(*keyframe);
                              },
                              {.qos = qos::kKeyframes, .required = false});
  context.subscribe<Keyframe>({"map_keyframe", topics::kMapKeyframe},
                              [this](const auto& keyframe) { on_map_keyframe(*keyframe); },
                              {.qos = qos::kKeyframes, .required = false});
  context.subscribe<MapUpdate>({"map_update", topics::kMapUpdate},
                               [this](const auto& update) { on_map_update(*update); },
                               {.qos = qos::kKeyframes});
  context.subscribe<Keyframe>({"relocalisation_request", topics::kRelocalisationRequest},
                              [this](const auto& request) { on_request(*request); },
                              {.qos = qos::kFrames, .required = false});
  context.every(std::chrono::seconds(1), [this] { report(); });
}

void LoopClosingComponent::start() {
  if (config_.lockstep) return;
  worker_ = std::make_unique<loop_closing::Worker>([this](const std::exception_ptr& error) {
    context_.post([error] { std::rethrow_exception(error); });
  });
}

void LoopClosingComponent::run(const HeavyWork& work) {
  if (!worker_) return work()();
  worker_->add([this, work] { context_.post(work()); });
}

void LoopClosingComponent::on_keyframe(const Keyframe& message) {
  const auto work = progress_.measure();
  order_.add(conversion::read_keyframe(message));
  advance();
}

void LoopClosingComponent::on_map_keyframe(const Keyframe& message) {
  closer_.insert(conversion::read_keyframe(message));
  order_.know(message.id());
  advance();
  // Frame 0: no frame of this run is meant. Says that the keyframe has come, and sends for more.
  auto received = corrections_.loan();
  received->map_epoch(closer_.map().map_epoch());
  received->query_keyframe_id(message.id());
  corrections_.publish(std::move(received));
}

void LoopClosingComponent::on_map_update(const MapUpdate& message) {
  const auto work = progress_.measure();
  order_.add(loop_closing::to_map_change(message), message.header().frame_id());
  advance();
}

void LoopClosingComponent::advance() {
  while (const auto step = order_.next()) {
    for (const auto& keyframe : step->refused) answer_keyframe(header_of(keyframe), nullptr);
    for (const auto& keyframe : step->keyframes) closer_.insert(keyframe);
    closer_.update(step->change);
    for (const auto& keyframe : step->keyframes) look_for_loops(header_of(keyframe), keyframe.id);
  }
}

void LoopClosingComponent::look_for_loops(const Header& header, tracking::KeyframeId id) {
  const bool must = resent_.erase(id) > 0;  // a loop may have been closed there before
  const bool busy =
      !must && worker_ && worker_->busy() >= static_cast<std::size_t>(config_.max_waiting);
  left_out_ += busy ? 1 : 0;
  auto task = std::make_shared<loop::VerificationTask>();
  if (config_.enabled && !busy) *task = closer_.detect(id);
  if (task->empty()) return answer_keyframe(header, nullptr);
  run([this, header, id, task] {
    const double before_s = thread_processor_time_s();
    auto places = loop::verify(*task, camera_, config_.loop);
    const double time_s = worker_ ? thread_processor_time_s() - before_s : 0.0;
    return [this, header, id, time_s, places = std::move(places)] {
      progress_.add(time_s);
      verified(header, id, places);
    };
  });
}

void LoopClosingComponent::verified(const Header& header,
                                    tracking::KeyframeId id,
                                    const std::vector<loop::VerifiedPlace>& places) {
  auto task = closer_.consider(id, places);
  if (!task) return answer_keyframe(header, nullptr);
  const auto shared = std::make_shared<loop::CorrectionTask>(std::move(*task));
  run([this, header, shared] {
    const double before_s = thread_processor_time_s();
    auto correction = loop::correct(*shared);
    const double time_s = thread_processor_time_s() - before_s;
    return [this, header, time_s, correction = std::move(correction)] {
      if (worker_) progress_.add(time_s);
      context_.log().info("loop {} -> {}{}: {}, {:.0f} ms",
                          correction.loop.query_id,
                          correction.loop.match_id,
                          correction.loop.by_surfaces ? " by surfaces" : "",
                          correction.summary.to_string(),
                          1e3 * time_s);
      context_.diagnostics().set("pose_graph", correction.summary.to_string());
      context_.diagnostics().set("pose_graph_ms", 1e3 * time_s);
      corrected(header, correction);
    };
  });
}

void LoopClosingComponent::corrected(const Header& header, const loop::Correction& correction) {
  closer_.finish(correction);
  const bool current = correction.map_epoch == closer_.map().map_epoch();
  outdated_ += current ? 0 : 1;
  if (correction.T_map_camera.empty()) {
    context_.log().warn("loop {} -> {} not closed: the pose graph does not bear it",
                        correction.loop.query_id,
                        correction.loop.match_id);
  }
  answer_keyframe(header, current && !correction.T_map_camera.empty() ? &correction : nullptr);
}

void LoopClosingComponent::answer_keyframe(const Header& header,
                                           const loop::Correction* correction) {
  auto message = corrections_.loan();
  message->header() = header;
  message->map_epoch(closer_.map().map_epoch());
  if (correction != nullptr && !loop_closing::write(*correction, *message)) {
    context_.log().error("a correction of {} keyframes is more than a message can carry",
                         correction->T_map_camera.size());
  }
  corrections_.publish(std::move(message));
  progress_.done(header);
}

void LoopClosingComponent::on_request(const Keyframe& message) {
  const auto work = progress_.measure();
  ++requests_;
  const auto header = message.header();
  const bool busy = worker_ && worker_->busy() >= static_cast<std::size_t>(config_.max_waiting);
  if (busy) return answer_request(header, {});
  auto features =
      std::make_shared<features::FrameFeatures>(conversion::read_keyframe(message).features);
  auto task = std::make_shared<loop::VerificationTask>(closer_.detect_lost(std::move(features)));
  run([this, header, task] {
    auto places = loop::verify(*task, camera_, config_.loop);
    return [this, header, places = std::move(places)] { answer_request(header, places); };
  });
}

void LoopClosingComponent::answer_request(const Header& header,
                                          const std::vector<loop::VerifiedPlace>& places) {
  auto message = answers_.loan();
  message->header() = header;
  message->map_epoch(closer_.map().map_epoch());
  if (const auto found = closer_.relocalise(places)) {
    ++relocalised_;
    loop_closing::write(*found, *message);
  }
  answers_.publish(std::move(message));
  progress_.done(header);
}

void LoopClosingComponent::report() {
  auto& diagnostics = context_.diagnostics();
  const auto& statistics = closer_.statistics();
  diagnostics.set("keyframes", std::uint64_t{closer_.map().keyframes().size()});
  diagnostics.set("index_mb", 1e-6 * static_cast<double>(closer_.index().bytes()));
  diagnostics.set("places_verified", statistics.places_verified);
  diagnostics.set("places_confirmed", statistics.places_confirmed);
  diagnostics.set("surfaces_compared", statistics.surfaces_compared);
  diagnostics.set("surfaces_confirmed", statistics.surfaces_confirmed);
  diagnostics.set("surface_loops", statistics.surface_loops);
  diagnostics.set("places_implausible", statistics.implausible);
  diagnostics.set("places_ambiguous", statistics.ambiguous);
  diagnostics.set("loops", statistics.loops);
  diagnostics.set("loops_left_out", statistics.loops_left_out);
  diagnostics.set("corrections", statistics.corrections);
  diagnostics.set("corrections_outdated", outdated_);
  diagnostics.set("keyframes_left_out", left_out_);
  diagnostics.set("messages_unpaired", std::uint64_t{order_.unpaired()});
  diagnostics.set("requests", requests_);
  diagnostics.set("relocalised", relocalised_);
}

}  // namespace camvox
