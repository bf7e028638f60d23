#pragma once

#include <cstdint>

#include "camvox/component/publisher.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/mapping/mapper.hpp"

namespace camvox::mapping_component {

/// Sends changes of the map, in as many messages as their capacity asks for; none if there are
/// none.
void publish_changes(const mapping::MapChanges& changes,
                     std::uint64_t map_epoch,
                     const camvox_interfaces::msg::MessageHeader& header,
                     Publisher<camvox_interfaces::msg::MapUpdate>& publisher);

}  // namespace camvox::mapping_component
