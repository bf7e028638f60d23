#include "camvox/test/pipeline.hpp"

namespace camvox::test {
namespace {

namespace msg = camvox_interfaces::msg;

template <typename Config>
void set_block(FakeContext& context, const std::string& block, const Config& config) {
  for (const auto& [key, parameter] : config::dump(config)) {
    context.set_parameter(block + "." + key, parameter.value);
  }
}

}  // namespace

void Pipeline::give_parameters(const Recording& recording, FakeContext& context) {
  const auto& name = context.name();
  const bool has_rig = name != "mapping" && name != "loop_closing";
  if (name != "deskew") set_block(context, "camera", recording.options().intrinsics);
  if (has_rig) set_block(context, "rig", recording.options().rig);
  if (name != "sync") context.set_parameter("lockstep", true);
  if (name == "mapping") context.set_parameter("wait_for_loop_closing", true);
  if (name == "tracking") {
    context.set_parameter("frame.extractor.features", std::int64_t{1000});
  }
}

bool Pipeline::pass_everything_on() {
  bool any = pass_on<msg::FrameImage>(sync_, "frame_image", {&tracking_});
  any |= pass_on<msg::Scan>(sync_, "scan", {&deskew_});
  any |= pass_on<msg::Cloud>(deskew_, "cloud", {&depth_, &tracking_});
  any |= pass_on<msg::DepthImage>(depth_, "depth_image", {&tracking_});
  for (const auto& keyframe : tracking_.published<msg::Keyframe>("keyframe")) {
    keyframes_ += keyframe ? 1 : 0;
  }
  any |= pass_on<msg::Keyframe>(tracking_, "keyframe", {&mapping_, &loop_closing_});
  for (const auto& pose : tracking_.published<FramePose>("frame_pose")) poses_.push_back(*pose);
  any |= pass_on<FramePose>(tracking_, "frame_pose", {&mapping_, &deskew_});
  any |= pass_on<msg::Keyframe>(tracking_, "relocalisation_request", {&loop_closing_});
  any |= pass_on<msg::MapUpdate>(mapping_, "map_update", {&loop_closing_});
  any |= pass_on<msg::LoopCorrection>(loop_closing_, "loop_correction", {&mapping_});
  any |= pass_on<msg::RelocalisationAnswer>(loop_closing_, "relocalisation_answer", {&tracking_});
  any |= pass_on<msg::LocalMap>(mapping_, "local_map", {&tracking_});
  return any;
}

}  // namespace camvox::test
