#pragma once

#include <cstdint>
#include <vector>

#include "camvox/simulation/image.hpp"

namespace camvox::simulation {

/// The image as a JPEG file (4:2:0), quality 1 to 100. Throws std::logic_error on an empty image
/// or a quality out of range, std::runtime_error with libjpeg-turbo's message when it fails.
[[nodiscard]] std::vector<std::uint8_t> encode_jpeg(const ColorImage& image, int quality);

}  // namespace camvox::simulation
