#pragma once

#include <string_view>
#include <vector>

#include "camvox/bringup/probe.hpp"

/// What filling in and checking of a replay in lockstep share.
namespace camvox::bringup {

constexpr auto kLockstepComponents = "lockstep_components";

/// Null if the component has no such port.
[[nodiscard]] const ProbedPort* find_port(const ProbedComponent& component, std::string_view name);

/// Frames that the recording does not hold cannot hold the replay back.
[[nodiscard]] std::vector<Problem> check_lockstep_topic(const ProbedSystem& system,
                                                        const ProbedComponent& replay);

}  // namespace camvox::bringup
