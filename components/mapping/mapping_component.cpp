#include "camvox/mapping_component/mapping_component.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "camvox/conversion/map_messages.hpp"
#include "camvox/conversion/pose.hpp"
#include "camvox/mapping/map_file.hpp"
#include "map_update_message.hpp"

namespace camvox {
namespace {

namespace msg = camvox_interfaces::msg;

/// Frames that wait for a keyframe which was announced and did not come; then they are answered
/// without it.
constexpr std::size_t kMaxWaiting = 5;
constexpr std::size_t kMaxWaitingLockstep = 64;
/// After so many frames without a keyframe, missing ones are given up.
constexpr std::size_t kMaxFramesBehind = 64;
/// So many keyframes that come late are more than a lost message.
constexpr std::size_t kManyKeyframes = 3;
constexpr std::size_t kAnswersKept = 64;

std::filesystem::path map_path(const MappingComponentConfig& config) {
  return std::filesystem::path(config.output_dir) / "map.mcap";
}

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
                                                 {.qos = qos::kKeyframes})),
      announcer_(context) {
  context.subscribe<Keyframe>({"keyframe", topics::kKeyframe},
                              [this](const auto& keyframe) { on_keyframe(*keyframe); },
                              {.qos = qos::kKeyframes});
  context.subscribe<Keyframe>({"resent_keyframe", topics::kResentKeyframe},
                              [this](const auto& keyframe) { on_resent_keyframe(*keyframe); },
                              {.qos = qos::kKeyframes, .required = false});
  context.subscribe<FramePose>({"frame_pose", topics::kFramePose},
                               [this](const auto& pose) { on_pose(*pose); },
                               {.qos = {1024, true, false}});
  context.subscribe<LoopCorrection>(
      {"loop_correction", topics::kLoopCorrection},
      [this](const auto& correction) { on_correction(*correction); },
      {.qos = qos::kKeyframes,
       .required = config_.wait_for_loop_closing || !config_.load_map.empty()});
  context.on_parameter_change<MappingComponentConfig>(config_,
                                                      [this](const MappingComponentConfig& next) {
                                                        config_.save_map = next.save_map;
                                                        if (next.save_map) (void)save_changes();
                                                      },
                                                      {"save_map"});
  context.serve<std_srvs::srv::Trigger_Request, std_srvs::srv::Trigger_Response>(
      {"save_map", "/camvox/save_map"},
      [this](const auto&, auto& response) { on_save_request(response); });
  context.every(std::chrono::milliseconds(500), [this] { announce(); });
  context.every(std::chrono::seconds(1), [this] { report_memory(); });
}

void MappingComponent::start() {
  if (!config_.load_map.empty()) load();
  if (config_.lockstep) return;
  jobs_ = std::make_unique<mapping_component::JobSchedule>(
      context_, mapper_, [this](const mapping_component::SolvedJob& solved) {
        const auto work = progress_.measure();
        const bool taken = finish(solved.job, solved.summary, solved.time_s);
        publish_update(last_.header);
        publish_local_map(last_);
        return taken;
      });
}

void MappingComponent::stop() {
  if (jobs_) jobs_->stop();
  if (config_.save_map && !save_changes()) throw std::runtime_error("the map was not saved");
}

void MappingComponent::load() {
  auto loaded = mapping::load_map(config_.load_map, mapper_.model().camera());
  std::string problem = loaded.status().message();
  if (loaded.ok() && loaded->map.keyframes().empty()) problem = config_.load_map + ": an empty map";
  if (!problem.empty()) {
    context_.request_exit();  // nothing can be done without
    throw std::runtime_error(problem);
  }
  mapper_.restore(std::move(loaded->map), loaded->epoch, std::move(loaded->loop_ends));
  const auto& keyframes = mapper_.map().keyframes();
  newest_keyframe_ = keyframes.rbegin()->first;
  context_.log().info("{}: {} keyframes, {} landmarks, epoch {}",
                      config_.load_map,
                      keyframes.size(),
                      mapper_.map().landmark_count(),
                      mapper_.epoch());
  announcer_.begin(mapper_, updates_);
}

/// Why the map is not to be saved, or "".
std::string MappingComponent::nothing_to_save() const {
  if (config_.output_dir.empty()) return "there is no folder for it: output_dir (--out) is not set";
  if (config_.localisation_only) return "the loaded map stays as it is (localisation_only)";
  if (mapper_.map().keyframes().empty()) return "the map is empty";
  return {};
}

/// Returns what went wrong, or "".
std::string MappingComponent::save() {
  const auto& map = mapper_.map();
  const auto path = map_path(config_);
  const auto status =
      mapping::save_map(path, map, mapper_.epoch(), mapper_.model().camera(), mapper_.loop_ends());
  if (!status.ok()) {
    context_.log().error("{}", status.message());
    return status.message();
  }
  context_.log().info("map of {} keyframes, {} landmarks ({:.1f} MB) saved to {}",
                      map.keyframes().size(),
                      map.landmark_count(),
                      1e-6 * static_cast<double>(map.memory_bytes()),
                      path.string());
  return {};
}

/// False if there was something to save and it failed.
bool MappingComponent::save_changes() { return !nothing_to_save().empty() || save().empty(); }

void MappingComponent::on_save_request(std_srvs::srv::Trigger_Response& response) {
  auto problem = nothing_to_save();
  if (problem.empty()) problem = save();
  response.success(problem.empty());
  response.message(problem.empty() ? map_path(config_).string() : problem);
}

/// Until tracking has sent a pose it may not be there yet, or not hear what is said.
void MappingComponent::announce() {
  announcer_.repeat();
  const bool unheard = last_.header.frame_id() == 0 && waiting_.empty();
  if (!config_.load_map.empty() && announcer_.done() && unheard) publish_local_map(last_);
}

void MappingComponent::on_keyframe(const Keyframe& message) {
  const auto work = progress_.measure();
  if (message.id() <= newest_keyframe_) return;
  keyframes_.insert_or_assign(message.id(), conversion::read_keyframe(message));
  answer_ready();
}

/// What is sent again comes in order, and where it has a gap, there is no more.
void MappingComponent::on_resent_keyframe(const Keyframe& message) {
  const auto work = progress_.measure();
  if (message.id() <= newest_keyframe_) return;
  insert(conversion::read_keyframe(message));
  publish_update(message.header());
  answer_ready();
}

void MappingComponent::on_pose(const FramePose& pose) {
  const auto work = progress_.measure();
  if (pose.map_epoch() > mapper_.epoch()) take_over_epoch(pose);
  waiting_.push_back({pose.header(), pose.reference_keyframe_id()});
  answer_ready();
}

/// After a restart: a map of an earlier epoch would not be taken.
void MappingComponent::take_over_epoch(const FramePose& pose) {
  context_.log().info("map epoch {} taken over, it was {}", pose.map_epoch(), mapper_.epoch());
  mapper_.raise_epoch(pose.map_epoch());
  if (!announcer_.done()) return;  // its update, yet to come, will say it
  mapping_component::publish_changes(
      mapper_.all_changes(), mapper_.epoch(), pose.header(), updates_);
}

void MappingComponent::on_correction(const LoopCorrection& correction) {
  const auto work = progress_.measure();
  if (correction.header().frame_id() == 0) {  // about a keyframe of the loaded map
    announcer_.acknowledge(correction.query_keyframe_id());
    if (announcer_.done() && last_.header.frame_id() == 0) publish_local_map(last_);
    return answer_ready();
  }
  if (correction.keyframe_ids_count() > 0 && !config_.localisation_only) {
    mapping::LoopProposal proposal;
    proposal.map_epoch = correction.map_epoch();
    proposal.query = correction.query_keyframe_id();
    proposal.match = correction.match_keyframe_id();
    proposal.by_surfaces = correction.by_surfaces() != 0;
    for (std::uint32_t i = 0; i < correction.keyframe_ids_count(); ++i) {
      proposal.poses[correction.keyframe_ids()[i]] =
          conversion::to_se3(correction.keyframe_poses()[i]);
    }
    if (const auto problem = mapper_.correct(proposal); !problem.empty()) {
      context_.log().warn("loop correction not applied: {}", problem);
    } else {
      context_.log().info("loop from keyframe {} to {} closed{}, map epoch {}",
                          proposal.query,
                          proposal.match,
                          proposal.by_surfaces ? " by surfaces" : "",
                          mapper_.epoch());
      const bool full = config_.mapping.full_bundle_iterations > 0;
      if (config_.lockstep && full) adjust(mapper_.full_job());
      publish_update(correction.header());
      publish_local_map(last_);
      if (jobs_) {
        jobs_->interrupt();
        if (full) jobs_->want_full();
        jobs_->start_due();
      }
    }
  }
  loop_answers_.insert(correction.header().frame_id());
  while (loop_answers_.size() > kAnswersKept) loop_answers_.erase(loop_answers_.begin());
  answer_ready();
}

/// Whether the keyframe that the pose refers to is in the map, or has come, or never will.
bool MappingComponent::is_ready(const Waiting& frame) const {
  const auto patience = config_.lockstep ? kMaxWaitingLockstep : kMaxWaiting;
  return frame.reference_id <= newest_keyframe_ || waiting_.size() > patience;
}

/// Takes in the keyframes that have come, in order, as far as the frame knows them.
void MappingComponent::insert_up_to(const Waiting& frame) {
  while (!keyframes_.empty() && keyframes_.begin()->first <= frame.reference_id) {
    const bool in_order = keyframes_.begin()->first == newest_keyframe_ + 1;
    if (!in_order && frames_behind_ <= kMaxFramesBehind) return;
    insert(keyframes_.extract(keyframes_.begin()).mapped());
    // Loop closing looks at the keyframe as the map has it now.
    if (config_.lockstep) publish_update(frame.header);
  }
}

/// Notes whether keyframes are missing. When many have come late, what was told meanwhile may be
/// lost as well: all of the map is told again, and adjusted as a whole.
void MappingComponent::follow(const Waiting& frame) {
  const bool was_behind = std::exchange(behind_, frame.reference_id > newest_keyframe_);
  if (behind_) {
    ++frames_behind_;
    if (!was_behind && frame.reference_id >= newest_keyframe_ + kManyKeyframes) {
      context_.log().warn(
          "keyframes {} to {} are missing", newest_keyframe_ + 1, frame.reference_id);
    }
    return;
  }
  const auto late = std::exchange(inserted_behind_, 0);
  if (late < kManyKeyframes) return;
  context_.log().info("no keyframe is missing any more: {} in the map, the newest is {}",
                      mapper_.map().keyframes().size(),
                      newest_keyframe_);
  if (jobs_ && config_.mapping.full_bundle_iterations > 0) jobs_->want_full();
  mapping_component::publish_changes(
      mapper_.all_changes(), mapper_.epoch(), frame.header, updates_);
}

void MappingComponent::answer_ready() {
  // In lockstep nothing depends on how far the announcement has come.
  if (config_.lockstep && !announcer_.done()) return;
  while (!waiting_.empty()) {
    const Waiting frame = waiting_.front();
    insert_up_to(frame);
    if (!is_ready(frame)) return;
    const bool loop_open = config_.lockstep && config_.wait_for_loop_closing &&
                           frame.header.frame_id() == newest_keyframe_frame_ &&
                           !loop_answers_.contains(newest_keyframe_frame_);
    if (loop_open) return;
    waiting_.pop_front();
    follow(frame);
    answer(frame);
  }
}

std::string MappingComponent::problem_with(const tracking::Keyframe& keyframe) const {
  if (config_.localisation_only) return "the map stays as it is (localisation_only)";
  const bool tied = mapper_.map().anchor(keyframe.parent_id).keyframe != 0;
  if (config_.load_map.empty() || mapper_.map().keyframes().empty() || tied) return {};
  return "it is not tied to the loaded map (tracking needs load_map, too)";
}

void MappingComponent::insert(const tracking::Keyframe& keyframe) {
  newest_keyframe_ = std::max(newest_keyframe_, keyframe.id);
  frames_behind_ = 0;
  if (behind_) ++inserted_behind_;
  keyframes_.erase(keyframes_.begin(), keyframes_.upper_bound(keyframe.id));
  auto problem = problem_with(keyframe);
  if (problem.empty()) {
    mapper_.set_reference(keyframe.id);
    problem = mapper_.insert(keyframe).problem;
  }
  if (!problem.empty()) {
    context_.log().warn("keyframe {} not taken: {}", keyframe.id, problem);
    context_.diagnostics().set("keyframes refused", ++refused_);
    return;
  }
  newest_keyframe_frame_ = keyframe.frame_id;
  if (config_.lockstep) {
    adjust(mapper_.local_job(keyframe.id));
    mapper_.cull_keyframes(keyframe.id);
    return;
  }
  if (jobs_) jobs_->want_local(keyframe.id);
}

void MappingComponent::adjust(mapping::BundleJob job) {
  const double started_s = thread_processor_time_s();
  const auto summary = job.solve();
  (void)finish(job, summary, thread_processor_time_s() - started_s);
}

bool MappingComponent::finish(const mapping::BundleJob& job,
                              const optimization::BundleSummary& summary,
                              double time_s) {
  if (!mapper_.finish(job)) return false;
  if (!config_.lockstep && job.newest != 0) mapper_.cull_keyframes(job.newest);
  const auto text = summary.to_string(time_s);
  context_.diagnostics().set(job.whole_map ? "full bundle adjustment" : "local bundle adjustment",
                             text);
  if (job.whole_map) context_.log().info("full bundle adjustment: {}", text);
  return true;
}

void MappingComponent::answer(const Waiting& frame) {
  last_ = frame;
  mapper_.set_reference(frame.reference_id);
  publish_update(frame.header);
  publish_local_map(frame);
  if (jobs_) jobs_->start_due();
  report();
  progress_.done(frame.header);
}

void MappingComponent::publish_local_map(const Waiting& frame) {
  auto message = local_maps_.loan();
  const auto map = mapper_.local_map(frame.header.frame_id(), frame.reference_id);
  const auto left_out = conversion::write_local_map(map, *message);
  message->header() = frame.header;
  message->next_keyframe_id(std::max(map.next_keyframe_id, newest_keyframe_ + 1));
  local_maps_.publish(std::move(message));
  if (left_out > 0) context_.diagnostics().set("left out of the local map", left_out);
}

/// `header`: of the frame that the map has come to.
void MappingComponent::publish_update(Header header) {
  if (behind_) header.frame_id(std::min(header.frame_id(), newest_keyframe_frame_));
  mapping_component::publish_changes(mapper_.take_changes(), mapper_.epoch(), header, updates_);
}

void MappingComponent::report() {
  auto& diagnostics = context_.diagnostics();
  diagnostics.set("keyframes", std::uint64_t{mapper_.map().keyframes().size()});
  diagnostics.set("landmarks", std::uint64_t{mapper_.map().landmark_count()});
  diagnostics.set("epoch", mapper_.epoch());
}

void MappingComponent::report_memory() {
  const auto& map = mapper_.map();
  if (map.keyframes().empty()) return;
  const double kb = 1e-3 * static_cast<double>(map.memory_bytes());
  const double keyframe_kb = kb / static_cast<double>(map.keyframes().size());
  auto& diagnostics = context_.diagnostics();
  diagnostics.set("map MB", 1e-3 * kb);
  diagnostics.set("kB per keyframe", keyframe_kb);
  const bool over = keyframe_kb > config_.keyframe_budget_kb;
  diagnostics.report(over ? HealthLevel::kWarn : HealthLevel::kOk,
                     over ? "the map takes more than keyframe_budget_kb a keyframe" : "ok");
}

}  // namespace camvox
