#pragma once

#include <gtest/gtest.h>

#include "camvox/interfaces/camvox_interfaces.hpp"

namespace camvox::test {

/// All plain message types; plain_layout_test checks that none is missing.
using PlainTypes = ::testing::Types<camvox_interfaces::msg::MessageHeader,
                                    camvox_interfaces::msg::FrameImage,
                                    camvox_interfaces::msg::Scan,
                                    camvox_interfaces::msg::Cloud,
                                    camvox_interfaces::msg::DepthImage,
                                    camvox_interfaces::msg::FramePose,
                                    camvox_interfaces::msg::Keyframe,
                                    camvox_interfaces::msg::LocalMap,
                                    camvox_interfaces::msg::MapUpdate,
                                    camvox_interfaces::msg::LoopCorrection,
                                    camvox_interfaces::msg::RelocalisationAnswer,
                                    camvox_interfaces::msg::Extrinsics,
                                    camvox_interfaces::msg::Progress>;
inline constexpr std::size_t kPlainTypeCount = 13;

}  // namespace camvox::test
