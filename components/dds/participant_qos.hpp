#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>

#include "camvox/dds/participant.hpp"

namespace camvox::dds {

/// Transports and discovery for the options. Throws std::runtime_error with what is missing.
[[nodiscard]] eprosima::fastdds::dds::DomainParticipantQos participant_qos(
    ParticipantOptions options);

}  // namespace camvox::dds
