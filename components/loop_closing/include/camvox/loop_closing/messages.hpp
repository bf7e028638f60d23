#pragma once

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/loop/loop_closer.hpp"

namespace camvox::loop_closing {

/// Throws std::invalid_argument or std::logic_error for a message that is not well formed.
[[nodiscard]] loop::MapChange to_map_change(const camvox_interfaces::msg::MapUpdate& message);

/// Fills all but the header. False, and no poses written, when there are more than fit.
[[nodiscard]] bool write(const loop::Correction& correction,
                         camvox_interfaces::msg::LoopCorrection& message);
/// Fills all but the header.
void write(const loop::Relocalisation& relocalisation,
           camvox_interfaces::msg::RelocalisationAnswer& message);

}  // namespace camvox::loop_closing
