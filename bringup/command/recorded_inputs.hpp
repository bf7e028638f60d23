#pragma once

#include "camvox/bringup/probe.hpp"
#include "camvox/component/logger.hpp"

namespace camvox::command {

/// Says which sensor inputs get nothing from the recording that a component of the config replays.
void warn_of_unrecorded_inputs(const bringup::ProbedSystem& system, Logger& log);

}  // namespace camvox::command
