#pragma once

#include <string>

/// Texts of standard messages (field names and types as their packages define them), and how
/// `ros2 bag` puts them together.
namespace camvox::storage {

inline const std::string kTime = "int32 sec\nuint32 nanosec\n";
inline const std::string kHeader = "builtin_interfaces/Time stamp\nstring frame_id\n";
inline const std::string kVector3 = "float64 x\nfloat64 y\nfloat64 z\n";
inline const std::string kQuaternion = "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";

inline std::string dependency(const std::string& type, const std::string& text) {
  return std::string(80, '=') + "\nMSG: " + type + "\n" + text;
}

inline const std::string kHeaderAndTime =
    dependency("std_msgs/Header", kHeader) + dependency("builtin_interfaces/Time", kTime);

inline const std::string kImu =
    "# This is a message to hold data from an IMU\n"
    "std_msgs/Header header\n\n"
    "geometry_msgs/Quaternion orientation\n"
    "float64[9] orientation_covariance # Row major about x, y, z axes\n\n"
    "geometry_msgs/Vector3 angular_velocity\n"
    "float64[9] angular_velocity_covariance\n\n"
    "geometry_msgs/Vector3 linear_acceleration\n"
    "float64[9] linear_acceleration_covariance\n" +
    kHeaderAndTime + dependency("geometry_msgs/Quaternion", kQuaternion) +
    dependency("geometry_msgs/Vector3", kVector3);

inline const std::string kImage =
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n"
    "uint32 step\nuint8[] data\n" +
    kHeaderAndTime;

inline const std::string kPointField =
    "uint8 INT8    = 1\nuint8 UINT8   = 2\nuint8 FLOAT32 = 7\n"
    "string name      # Name of field\nuint32 offset    # Offset from start of point struct\n"
    "uint8  datatype  # Datatype enumeration, see above\nuint32 count     # How many elements\n";

inline const std::string kPointCloud2 =
    "std_msgs/Header header\nuint32 height\nuint32 width\nPointField[] fields\nbool is_bigendian\n"
    "uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n" +
    kHeaderAndTime + dependency("sensor_msgs/PointField", kPointField);

inline const std::string kTfMessage =
    "geometry_msgs/TransformStamped[] transforms\n" +
    dependency("geometry_msgs/TransformStamped",
               "std_msgs/Header header\nstring child_frame_id\nTransform transform\n") +
    dependency("geometry_msgs/Transform", "Vector3 translation\nQuaternion rotation\n") +
    dependency("geometry_msgs/Vector3", kVector3) +
    dependency("geometry_msgs/Quaternion", kQuaternion) + kHeaderAndTime;

}  // namespace camvox::storage
