#pragma once

#include <bzlib.h>
#include <lz4frame.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace camvox::import {

/// Bytes as ROS 1 serialises them: packed and little-endian.
class Ros1Bytes {
 public:
  template <typename T>
  Ros1Bytes& number(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
    return *this;
  }
  Ros1Bytes& u8(std::uint8_t value) { return number(value); }
  Ros1Bytes& u32(std::uint32_t value) { return number(value); }
  Ros1Bytes& f32(float value) { return number(value); }
  Ros1Bytes& f64s(const std::vector<double>& values) {
    for (const double value : values) number(value);
    return *this;
  }
  Ros1Bytes& text(const std::string& value) {
    u32(static_cast<std::uint32_t>(value.size()));
    bytes_ += value;
    return *this;
  }
  /// std_msgs/Header of ROS 1, with its seq.
  Ros1Bytes& header(std::uint32_t sec, std::uint32_t nsec, const std::string& frame) {
    return u32(77).u32(sec).u32(nsec).text(frame);
  }
  [[nodiscard]] const std::string& str() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Writes a ROS 1 bag of format 2.0, from its public description (wiki.ros.org/Bags/Format/2.0).
class Ros1BagFile {
 public:
  explicit Ros1BagFile(std::string compression = "none") : compression_(std::move(compression)) {}

  void connection(std::uint32_t id,
                  const std::string& topic,
                  const std::string& type,
                  const std::string& definition,
                  const std::string& more_fields = {}) {
    const auto data = field("topic", topic) + field("type", type) + field("md5sum", "*") +
                      field("message_definition", definition) + more_fields;
    chunk_ += record(op(0x07) + field("conn", raw(id)) + field("topic", topic), data);
  }
  void message(std::uint32_t id, std::uint32_t sec, std::uint32_t nsec, const std::string& data) {
    chunk_ += record(op(0x02) + field("conn", raw(id)) + field("time", raw(sec) + raw(nsec)), data);
  }
  void end_chunk() {
    const auto size = static_cast<std::uint32_t>(chunk_.size());
    chunks_ += record(op(0x05) + field("compression", compression_) + field("size", raw(size)),
                      compressed());
    chunks_ += record(op(0x04) + field("ver", raw(std::uint32_t{1})), "index");
    chunk_.clear();
  }
  [[nodiscard]] std::string str() {
    if (!chunk_.empty()) end_chunk();
    auto head = op(0x03) + field("index_pos", raw(std::uint64_t{4117})) +
                field("conn_count", raw(std::uint32_t{1})) +
                field("chunk_count", raw(std::uint32_t{1}));
    return "#ROSBAG V2.0\n" + record(head, std::string(64, ' ')) + chunks_ +
           record(op(0x06) + field("ver", raw(std::uint32_t{1})), "chunk info");
  }

  static std::string field(const std::string& name, const std::string& value) {
    return sized(name + "=" + value);
  }

 private:
  template <typename T>
  static std::string raw(T value) {
    return {reinterpret_cast<const char*>(&value), sizeof(value)};
  }
  static std::string sized(const std::string& text) {
    return raw(static_cast<std::uint32_t>(text.size())) + text;
  }
  static std::string op(char code) { return field("op", std::string(1, code)); }
  static std::string record(const std::string& header, const std::string& data) {
    return sized(header) + sized(data);
  }

  [[nodiscard]] std::string compressed() const {
    if (compression_ == "bz2") {
      std::string out(chunk_.size() * 2 + 1000, '\0');
      auto size = static_cast<unsigned>(out.size());
      BZ2_bzBuffToBuffCompress(out.data(),
                               &size,
                               const_cast<char*>(chunk_.data()),
                               static_cast<unsigned>(chunk_.size()),
                               9,
                               0,
                               0);
      out.resize(size);
      return out;
    }
    if (compression_ == "lz4") {
      std::string out(LZ4F_compressFrameBound(chunk_.size(), nullptr), '\0');
      out.resize(LZ4F_compressFrame(out.data(), out.size(), chunk_.data(), chunk_.size(), nullptr));
      return out;
    }
    return chunk_;
  }

  std::string compression_;
  std::string chunk_;
  std::string chunks_;
};

/// Definitions of ROS 1, as a bag holds them.
namespace ros1 {

inline std::string with(const std::string& definition, const std::vector<std::string>& parts) {
  auto text = definition;
  for (const auto& part : parts) text += std::string(80, '=') + "\nMSG: " + part;
  return text;
}
inline const std::string kHeader =
    "std_msgs/Header\n# Standard metadata: it's for stamped data.\nuint32 seq\n"
    "#Two-integer timestamp\ntime stamp\nstring frame_id\n";
inline const std::string kVector3 = "geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
inline const std::string kPoint = "geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n";
inline const std::string kQuaternion =
    "geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
inline const std::string kImu = with(
    "Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance # row "
    "major\ngeometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
    {kHeader, kQuaternion, kVector3});
inline const std::string kImage = with(
    "Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n"
    "uint32 step\nuint8[] data\n",
    {kHeader});
inline const std::string kCompressedImage =
    with("Header header\nstring format\nuint8[] data\n", {kHeader});
inline const std::string kCameraInfo = with(
    "Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] D\n"
    "float64[9]  K # 3x3\nfloat64[9]  R\nfloat64[12] P\nuint32 binning_x\nuint32 binning_y\n"
    "RegionOfInterest roi\n",
    {kHeader,
     "sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\n"
     "uint32 width\nbool do_rectify\n"});
inline const std::string kPointCloud2 = with(
    "Header header\nuint32 height\nuint32 width\nPointField[] fields\nbool is_bigendian\n"
    "uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    {kHeader,
     "sensor_msgs/PointField\nuint8 INT8    = 1\nuint8 FLOAT32 = 7\nstring name\nuint32 offset\n"
     "uint8 datatype\nuint32 count\n"});
inline const std::string kNavSatFix = with(
    "Header header\nNavSatStatus status\nfloat64 latitude\nfloat64 longitude\nfloat64 altitude\n"
    "float64[9] position_covariance\nuint8 COVARIANCE_TYPE_KNOWN = 3\n"
    "uint8 position_covariance_type\n",
    {kHeader, "sensor_msgs/NavSatStatus\nint8 STATUS_NO_FIX = -1\nint8 status\nuint16 service\n"});
inline const std::string kPose = "geometry_msgs/Pose\nPoint position\nQuaternion orientation\n";
inline const std::string kOdometry = with(
    "Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
    "geometry_msgs/TwistWithCovariance twist\n",
    {kHeader,
     "geometry_msgs/PoseWithCovariance\nPose pose\nfloat64[36] covariance\n",
     kPose,
     kPoint,
     kQuaternion,
     "geometry_msgs/TwistWithCovariance\nTwist twist\nfloat64[36] covariance\n",
     "geometry_msgs/Twist\nVector3 linear\nVector3 angular\n",
     kVector3});
inline const std::string kTransforms = with(
    "geometry_msgs/TransformStamped[] transforms\n",
    {"geometry_msgs/TransformStamped\nHeader header\nstring child_frame_id\nTransform transform\n",
     kHeader,
     "geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n",
     kVector3,
     kQuaternion});
/// `package`: of the driver; the first drivers had no tag.
inline std::string livox(const std::string& package, bool tag) {
  return with(
      "Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3]  rsvd\n"
      "CustomPoint[] points\n",
      {kHeader,
       package +
           "/CustomPoint\nuint32 offset_time # ns\nfloat32 x\nfloat32 y\nfloat32 z\n"
           "uint8 reflectivity\n" +
           (tag ? "uint8 tag\n" : "") + "uint8 line\n"});
}

}  // namespace ros1
}  // namespace camvox::import
