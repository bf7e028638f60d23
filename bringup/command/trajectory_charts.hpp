#pragma once

#include <string>
#include <vector>

#include "camvox/trajectory/chart.hpp"
#include "camvox/trajectory/trajectory.hpp"

namespace camvox::command {

/// Reference and estimate from above; where z cannot be up, in the two axes in which the reference
/// goes farthest. The title says which.
[[nodiscard]] trajectory::Chart plan_chart(const std::vector<trajectory::PosePair>& aligned);

/// Distance between the two over time.
[[nodiscard]] trajectory::Chart error_chart(const std::vector<trajectory::PosePair>& aligned);

/// One SVG with the others below each other.
[[nodiscard]] std::string stack_svgs(const std::vector<std::string>& svgs);

}  // namespace camvox::command
