#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "camvox/interfaces/header.hpp"
#include "camvox/sync_component/lidar_input.hpp"

namespace camvox::sync_component {
namespace {

static_assert(std::endian::native == std::endian::little, "clouds are read little-endian");

using sensor_msgs::msg::PointCloud2;
using sensor_msgs::msg::PointField;

constexpr std::array<std::size_t, 9> kFieldBytes = {0, 1, 1, 2, 2, 4, 4, 4, 8};  // by datatype
constexpr std::uint8_t kUint32 = 6, kFloat32 = 7, kFloat64 = 8;

/// A field of a point; reads as double whatever its type.
struct Field {
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;

  [[nodiscard]] double read(const std::uint8_t* point) const {
    switch (datatype) {
      case 1:
        return as<std::int8_t>(point);
      case 2:
        return as<std::uint8_t>(point);
      case 3:
        return as<std::int16_t>(point);
      case 4:
        return as<std::uint16_t>(point);
      case 5:
        return as<std::int32_t>(point);
      case 6:
        return as<std::uint32_t>(point);
      case 7:
        return static_cast<double>(as<float>(point));
      default:
        return as<double>(point);
    }
  }
  template <typename T>
  [[nodiscard]] T as(const std::uint8_t* point) const {
    T value;
    std::memcpy(&value, point + offset, sizeof(value));
    return value;
  }
};

/// The first of the names that the cloud has.
std::optional<Field> find_field(const PointCloud2& cloud,
                                std::initializer_list<std::string_view> names) {
  for (const auto name : names) {
    for (const auto& field : cloud.fields()) {
      const auto type = field.datatype();
      if (field.name() != name || type == 0 || type >= kFieldBytes.size()) continue;
      if (field.offset() + kFieldBytes[type] > cloud.point_step()) continue;
      return Field{field.offset(), type};
    }
  }
  return std::nullopt;
}

struct Fields {
  Field x, y, z;
  std::optional<Field> reflectivity, line, time;
};

std::string find_fields(const PointCloud2& cloud, Fields& fields) {
  const auto x = find_field(cloud, {"x"}), y = find_field(cloud, {"y"}),
             z = find_field(cloud, {"z"});
  if (!x || !y || !z) return "has no fields x, y, z";
  if (x->datatype < kFloat32 || y->datatype != x->datatype || z->datatype != x->datatype) {
    return "has x, y, z that are neither all float32 nor all float64";
  }
  fields = {*x, *y, *z, {}, {}, {}};
  fields.reflectivity = find_field(cloud, {"reflectivity", "intensity"});
  fields.line = find_field(cloud, {"line", "ring", "channel"});
  fields.time = find_field(
      cloud, {"offset_time", "t", "time", "timestamp", "time_stamp", "time_offset", "stamp"});
  return {};
}

/// What turns a value of the time field into ns after the header's stamp: scale, then origin.
struct TimeUnit {
  double scale = 1.0;
  double origin = 0.0;
};

TimeUnit time_unit(const std::string& name, const Field& time, double example, double stamp_ns) {
  constexpr double kEpoch_s = 1e8, kEpoch_ns = 1e17;  // times since the epoch are above these
  double scale = time.datatype < kFloat32 ? 1.0 : 1e9;
  if (name == "s") scale = 1e9;
  if (name == "ms") scale = 1e6;
  if (name == "us") scale = 1e3;
  if (name == "ns") scale = 1.0;
  if (name == "auto" && time.datatype == kFloat64 && std::abs(example) > kEpoch_ns) scale = 1.0;
  const bool since_epoch = std::abs(example) * scale > kEpoch_s * 1e9;
  return {scale, since_epoch ? stamp_ns / scale : 0.0};
}

float clip_reflectivity(double value) {
  return value > 0.0 ? static_cast<float>(std::min(value, 255.0)) : 0.0F;
}

class Reader {
 public:
  Reader(const PointCloud2& cloud, const Fields& fields) : cloud_(cloud), fields_(fields) {}

  /// Times of all points in ns after the header's stamp; their range.
  std::string read_times(const std::string& unit_name) {
    const std::size_t count = points();
    times_ns_.assign(count, 0.0);
    if (!fields_.time || count == 0) return {};
    const auto unit = time_unit(unit_name,
                                *fields_.time,
                                fields_.time->read(point(0)),
                                static_cast<double>(interfaces::stamp_of(cloud_.header())));
    for (std::size_t i = 0; i < count; ++i) {
      times_ns_[i] = (fields_.time->read(point(i)) - unit.origin) * unit.scale;
    }
    const auto [first, last] = std::ranges::minmax(times_ns_);
    first_ns_ = first;
    constexpr double kLongest_ns = 1e9;
    const bool plausible = first > -kLongest_ns && last < kLongest_ns;
    return plausible ? "" : "has point times that are more than a second from its stamp";
  }

  void read_points(sync::LidarChunk& chunk) const {
    chunk.has_point_times = fields_.time.has_value();
    chunk.stamp_ns = interfaces::stamp_of(cloud_.header()) + std::llround(first_ns_);
    chunk.end_ns = chunk.stamp_ns;
    chunk.returns.clear();
    chunk.returns.reserve(points());
    for (std::size_t i = 0; i < points(); ++i) {
      const auto* data = point(i);
      sync::LidarReturn point{};
      point.x_m = coordinate(fields_.x, data);
      point.y_m = coordinate(fields_.y, data);
      point.z_m = coordinate(fields_.z, data);
      point.offset_ns = static_cast<std::uint32_t>(times_ns_[i] - first_ns_);
      chunk.end_ns = std::max(chunk.end_ns, chunk.stamp_ns + point.offset_ns);
      if (!lidar::keep_livox_return(
              point.x_m, point.y_m, point.z_m, 0, lidar::NoiseConfidence::kKeepAll)) {
        continue;
      }
      if (fields_.reflectivity) {
        point.reflectivity = clip_reflectivity(fields_.reflectivity->read(data));
      }
      if (fields_.line) {
        point.line = static_cast<std::uint8_t>(std::clamp(fields_.line->read(data), 0.0, 255.0));
      }
      chunk.returns.push_back(point);
    }
  }

 private:
  [[nodiscard]] std::size_t points() const {
    return static_cast<std::size_t>(cloud_.width()) * cloud_.height();
  }
  [[nodiscard]] const std::uint8_t* point(std::size_t i) const {
    const std::size_t row = i / cloud_.width(), column = i % cloud_.width();
    return cloud_.data().data() + row * cloud_.row_step() + column * cloud_.point_step();
  }
  [[nodiscard]] static float coordinate(const Field& field, const std::uint8_t* data) {
    return field.datatype == kFloat32 ? field.as<float>(data)
                                      : static_cast<float>(field.as<double>(data));
  }

  const PointCloud2& cloud_;
  const Fields& fields_;
  std::vector<double> times_ns_;
  double first_ns_ = 0.0;
};

std::string size_problem(const PointCloud2& cloud) {
  if (cloud.is_bigendian()) return "is big-endian";
  if (cloud.width() == 0 || cloud.height() == 0) return {};
  const std::size_t row_bytes = std::size_t{cloud.width()} * cloud.point_step();
  const std::size_t needed = std::size_t{cloud.row_step()} * (cloud.height() - 1) + row_bytes;
  const bool fits = cloud.row_step() >= row_bytes || cloud.height() == 1;
  return fits && cloud.data().size() >= needed ? "" : "has fewer bytes than its size says";
}

}  // namespace

std::string read_point_cloud(const PointCloud2& message,
                             const LidarInputOptions& options,
                             sync::LidarChunk& chunk) {
  if (auto problem = size_problem(message); !problem.empty()) return problem;
  Fields fields;
  if (auto problem = find_fields(message, fields); !problem.empty()) return problem;
  Reader reader(message, fields);
  if (auto problem = reader.read_times(options.point_time_unit); !problem.empty()) return problem;
  reader.read_points(chunk);
  return {};
}

}  // namespace camvox::sync_component
