#pragma once

#include "camvox/simulation/options.hpp"
#include "camvox/simulation/route.hpp"

namespace camvox::simulation {

/// The motion that `options.motion` names, in `world`. Not for "given".
[[nodiscard]] Trajectory make_motion(const SimulationOptions& options, const World& world);

}  // namespace camvox::simulation
