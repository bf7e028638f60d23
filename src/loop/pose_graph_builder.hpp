#pragma once

#include <deque>

#include "camvox/loop/loop_closer.hpp"

namespace camvox::loop {

/// The pose graph of a map: parents and strong neighbours as they are in the map now, weighted with
/// what they are worth, and the loops as they were measured. The oldest keyframe of each connected
/// part is fixed.
[[nodiscard]] CorrectionTask build_correction(const MapReplica& map,
                                              const std::deque<LoopMeasurement>& loops,
                                              const LoopMeasurement& newest,
                                              const LoopCloserConfig& config);

}  // namespace camvox::loop
