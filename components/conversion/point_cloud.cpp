#include "camvox/conversion/point_cloud.hpp"

#include <cstring>

namespace camvox::conversion {
namespace {

constexpr std::uint32_t kPointBytes = 16;  // x y z as float, rgb packed into one

}  // namespace

void write_points(const std::vector<dense::ColouredPoint>& points,
                  sensor_msgs::msg::PointCloud2& cloud) {
  const char* names[] = {"x", "y", "z", "rgb"};
  for (std::uint32_t i = 0; i < 4; ++i) {
    sensor_msgs::msg::PointField field;
    field.name(names[i]);
    field.offset(4 * i);
    field.datatype(7);  // FLOAT32
    field.count(1);
    cloud.fields().push_back(field);
  }
  cloud.height(1);
  cloud.width(static_cast<std::uint32_t>(points.size()));
  cloud.point_step(kPointBytes);
  cloud.row_step(kPointBytes * cloud.width());
  cloud.is_dense(true);
  cloud.data().resize(kPointBytes * points.size());
  auto* out = cloud.data().data();
  for (const auto& [p, rgb] : points) {
    const std::uint32_t packed =
        (std::uint32_t{rgb[0]} << 16) | (std::uint32_t{rgb[1]} << 8) | rgb[2];
    std::memcpy(out, p.data(), 12);
    std::memcpy(out + 12, &packed, 4);
    out += kPointBytes;
  }
}

}  // namespace camvox::conversion
