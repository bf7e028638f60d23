#include "camvox/mapping_component/mapping_component.hpp"

#include <algorithm>
#include <utility>

#include "camvox/conversion/map_messages.hpp"
#include "camvox/conversion/pose.hpp"
#include "map_update_message.hpp"

namespace camvox {
namespace {

namespace msg = camvox_interfaces::msg;

/// Frames that wait for a keyframe which was announced and did not come; then they are answered
/// without it.
constexpr std::size_t kMaxWaiting = 64;
constexpr std::size_t kAnswersKept = 64;

}  // namespace

MappingComponent::MappingComponent(Context& context)
    : context_(context),
      config_(context.parameters<MappingComponentConfig>()),
      mapper_(config_.mapping,
              tracking::FrameBuilder(config_.frame, config_.camera).tracking_camera()),
      progress_(context),
      local_maps_(context.advertise<msg::LocalMap>({"local_map", topics::kLocalMap},
                                                   {.qos = qos::kFrames})),
      updates_(context.advertise<msg::MapUpdate>({"map_update", topics::kMapUpdate},
                                                 {.qos = qos::kKeyframes})) {
  context.subscribe<Keyframe>({"keyframe", topics::kKeyframe},
                              [this](const auto& keyframe) { on_keyframe(*keyframe); },
                              {.qos = qos::kKeyframes});
  context.subscribe<FramePose>({"frame_pose", topics::kFramePose},
                               [this](const auto& pose) { on_pose(*pose); },
                               {.qos = {1024, true, false}});
  context.subscribe<LoopCorrection>(
      {"loop_correction", topics::kLoopCorrection},
      [this](const auto& correction) { on_correction(*correction); },
      {.qos = qos::kKeyframes, .required = config_.wait_for_loop_closing});
}

void MappingComponent::start() {
  if (config_.lockstep) return;
  runner_ = std::make_unique<mapping_component::JobRunner>(
      [this](mapping::BundleJob job, optimization::BundleSummary summary, double time_s) {
        context_.post([this, job = std::move(job), summary, time_s] {
          const auto work = progress_.measure();
          finish(job, summary, time_s);
          publish_update(last_.header);
          publish_local_map(last_);
          start_next_job();
        });
      });
}

void MappingComponent::stop() { runner_.reset(); }

void MappingComponent::on_keyframe(const Keyframe& message) {
  const auto work = progress_.measure();
  auto keyframe = conversion::read_keyframe(message);
  const auto id = keyframe.id;
  keyframes_.insert_or_assign(id, std::move(keyframe));
  answer_ready();
}

void MappingComponent::on_pose(const FramePose& pose) {
  const auto work = progress_.measure();
  waiting_.push_back({pose.header(), pose.reference_keyframe_id()});
  answer_ready();
}

void MappingComponent::on_correction(const LoopCorrection& correction) {
  const auto work = progress_.measure();
  if (correction.keyframe_ids_count() > 0) {
    mapping::LoopProposal proposal;
    proposal.map_epoch = correction.map_epoch();
    proposal.query = correction.query_keyframe_id();
    proposal.match = correction.match_keyframe_id();
    for (std::uint32_t i = 0; i < correction.keyframe_ids_count(); ++i) {
      proposal.poses[correction.keyframe_ids()[i]] =
          conversion::to_se3(correction.keyframe_poses()[i]);
    }
    if (const auto problem = mapper_.correct(proposal); !problem.empty()) {
      context_.log().warn("loop correction not applied: {}", problem);
    } else {
      context_.log().info("loop from keyframe {} to {} closed, map epoch {}",
                          proposal.query,
                          proposal.match,
                          mapper_.epoch());
      full_due_ = config_.mapping.full_bundle_iterations > 0;
      if (config_.lockstep && full_due_) {
        adjust(mapper_.full_job());
        full_due_ = false;
      }
      publish_update(correction.header());
      publish_local_map(last_);
      start_next_job();
    }
  }
  loop_answers_.insert(correction.header().frame_id());
  while (loop_answers_.size() > kAnswersKept) loop_answers_.erase(loop_answers_.begin());
  answer_ready();
}

/// Whether the keyframe that the pose refers to is in the map, or has come, or never will.
bool MappingComponent::is_ready(const Waiting& frame) const {
  const auto id = frame.reference_id;
  return id <= newest_keyframe_ || keyframes_.contains(id) || waiting_.size() > kMaxWaiting;
}

void MappingComponent::answer_ready() {
  while (!waiting_.empty() && is_ready(waiting_.front())) {
    const Waiting frame = waiting_.front();
    const auto keyframe = keyframes_.find(frame.reference_id);
    if (keyframe != keyframes_.end()) {
      insert(keyframe->second);
      keyframes_.erase(keyframes_.begin(), std::next(keyframe));
      // Loop closing looks at the keyframe as the map has it now.
      if (config_.lockstep) publish_update(frame.header);
    }
    const bool loop_open = config_.lockstep && config_.wait_for_loop_closing &&
                           frame.header.frame_id() == newest_keyframe_frame_ &&
                           !loop_answers_.contains(newest_keyframe_frame_);
    if (loop_open) return;
    waiting_.pop_front();
    answer(frame);
  }
}

void MappingComponent::insert(const tracking::Keyframe& keyframe) {
  newest_keyframe_ = std::max(newest_keyframe_, keyframe.id);
  mapper_.set_reference(keyframe.id);
  const auto inserted = mapper_.insert(keyframe);
  if (!inserted.inserted) {
    context_.log().warn("keyframe {} not taken: {}", keyframe.id, inserted.problem);
    context_.diagnostics().set("keyframes refused", ++refused_);
    return;
  }
  newest_keyframe_frame_ = keyframe.frame_id;
  if (config_.lockstep) {
    adjust(mapper_.local_job(keyframe.id));
    mapper_.cull_keyframes(keyframe.id);
    return;
  }
  job_due_ = keyframe.id;
  if (runner_ != nullptr) runner_->interrupt();
}

void MappingComponent::adjust(mapping::BundleJob job) {
  const double started_s = thread_processor_time_s();
  const auto summary = job.solve();
  finish(job, summary, thread_processor_time_s() - started_s);
}

void MappingComponent::finish(const mapping::BundleJob& job,
                              const optimization::BundleSummary& summary,
                              double time_s) {
  if (!mapper_.finish(job)) return;
  if (!config_.lockstep && job.newest != 0) mapper_.cull_keyframes(job.newest);
  const auto text = summary.to_string(time_s);
  context_.diagnostics().set(job.whole_map ? "full bundle adjustment" : "local bundle adjustment",
                             text);
  if (job.whole_map) context_.log().info("full bundle adjustment: {}", text);
}

/// Live: what is due goes to the thread, the newest keyframe first.
void MappingComponent::start_next_job() {
  if (runner_ == nullptr || runner_->busy()) return;  // when it is done, this is called again
  if (job_due_ != 0) {
    auto job = mapper_.local_job(std::exchange(job_due_, 0));
    if (!job.empty()) return runner_->start(std::move(job));
  }
  if (std::exchange(full_due_, false)) {
    auto job = mapper_.full_job();
    if (!job.empty()) runner_->start(std::move(job));
  }
}

void MappingComponent::answer(const Waiting& frame) {
  last_ = frame;
  mapper_.set_reference(frame.reference_id);
  publish_update(frame.header);
  publish_local_map(frame);
  start_next_job();
  report();
  progress_.done(frame.header);
}

void MappingComponent::publish_local_map(const Waiting& frame) {
  auto message = local_maps_.loan();
  const auto map = mapper_.local_map(frame.header.frame_id(), frame.reference_id);
  const auto left_out = conversion::write_local_map(map, *message);
  message->header() = frame.header;
  local_maps_.publish(std::move(message));
  if (left_out > 0) context_.diagnostics().set("left out of the local map", left_out);
}

void MappingComponent::publish_update(const Header& header) {
  mapping_component::publish_changes(mapper_.take_changes(), mapper_.epoch(), header, updates_);
}

void MappingComponent::report() {
  auto& diagnostics = context_.diagnostics();
  diagnostics.set("keyframes", std::uint64_t{mapper_.map().keyframes().size()});
  diagnostics.set("landmarks", std::uint64_t{mapper_.map().landmark_count()});
  diagnostics.set("epoch", mapper_.epoch());
}

}  // namespace camvox
