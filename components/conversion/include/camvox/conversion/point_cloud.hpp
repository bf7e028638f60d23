#pragma once

#include <vector>

#include "camvox/dense/dense_map.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"

namespace camvox::conversion {

/// Coloured points as viewers read them: fields x y z and rgb (packed into a float), unordered. The
/// header is left as it is.
void write_points(const std::vector<dense::ColouredPoint>& points,
                  sensor_msgs::msg::PointCloud2& cloud);

}  // namespace camvox::conversion
