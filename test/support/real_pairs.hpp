#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "camvox/calibration/scene.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"

namespace camvox::test {

/// Real images with real clouds, and the extrinsics that came with them.
struct RealPair {
  calibration::Scene scene;
  sensors::CameraIntrinsics intrinsics;
  geometry::SE3 T_camera_lidar;
};

/// LibLZF, which PCL compresses with: a control byte below 32 copies that many bytes + 1, others
/// repeat earlier ones.
inline std::vector<char> lzf_decompressed(const std::vector<char>& packed, std::size_t size) {
  std::vector<char> out;
  out.reserve(size);
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(packed.at(i)); };
  for (std::size_t in = 0; in < packed.size();) {
    std::size_t control = byte(in++);
    if (control < 32) {
      for (std::size_t i = 0; i <= control; ++i) out.push_back(packed.at(in++));
      continue;
    }
    std::size_t length = control >> 5U;
    if (length == 7) length += byte(in++);
    const std::size_t back = ((control & 31U) << 8U) + byte(in++) + 1;
    if (back > out.size()) throw std::runtime_error("LZF data are broken");
    for (std::size_t i = 0; i < length + 2; ++i) out.push_back(out[out.size() - back]);
  }
  if (out.size() != size) throw std::runtime_error("LZF data have another size");
  return out;
}

/// x y z intensity, the first four fields, all float32, of a PCD file (ascii, binary_compressed).
inline std::vector<Eigen::Vector4f> read_pcd(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::size_t count = 0;
  std::string line;
  std::string storage;
  while (storage.empty() && std::getline(file, line)) {
    if (line.rfind("POINTS ", 0) == 0) count = std::stoul(line.substr(7));
    if (line.rfind("DATA ", 0) == 0) storage = line.substr(5);
  }
  std::vector<Eigen::Vector4f> points(count, Eigen::Vector4f::Zero());
  if (storage == "ascii") {
    for (auto& p : points) file >> p.x() >> p.y() >> p.z() >> p.w();
    return points;
  }
  std::uint32_t sizes[2] = {};
  file.read(reinterpret_cast<char*>(sizes), sizeof(sizes));
  std::vector<char> packed(sizes[0]);
  file.read(packed.data(), sizes[0]);
  const auto data = lzf_decompressed(packed, sizes[1]);  // field by field
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t field = 0; field < 4; ++field) {
      std::memcpy(
          &points[i][static_cast<Eigen::Index>(field)], &data.at(4 * (field * count + i)), 4);
    }
  }
  return points;
}

/// The numbers after `key` in a text of numbers, brackets, commas and blanks.
inline std::vector<double> numbers_after(const std::string& text,
                                         const std::string& key,
                                         std::size_t count) {
  std::string tail = text.substr(text.find(key) + key.size());
  for (char& c : tail) {
    if (c == '[' || c == ']' || c == ',' || c == ':' || c == '"') c = ' ';
  }
  std::istringstream stream(tail);
  std::vector<double> numbers(count);
  for (double& number : numbers) stream >> number;
  if (!stream) throw std::runtime_error(key + ": numbers are missing");
  return numbers;
}

inline std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path.string() + ": cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

/// From the first three rows of a matrix whose rotation has been rounded.
inline geometry::SE3 transform_of(const std::vector<double>& rows) {
  Eigen::Matrix<double, 3, 4> T;
  for (int i = 0; i < 12; ++i) T(i / 4, i % 4) = rows[static_cast<std::size_t>(i)];
  const Eigen::Quaterniond q(Eigen::Matrix3d(T.leftCols<3>()));
  return {geometry::SO3(q.normalized()), T.rightCols<1>()};
}

/// The two junctions of the OpenCalib project (`lidar_camera_pairs` of the shared data).
inline RealPair junction(const std::filesystem::path& pairs, char which) {
  RealPair pair;
  const auto folder = pairs / (std::string("junction_") + which);
  const auto text = which == 'a'
                        ? text_of(folder / "center_camera-intrinsic.json") +
                              text_of(folder / "top_center_lidar-to-center_camera-extrinsic.json")
                        : text_of(folder / "calib.txt");
  const bool json = which == 'a';
  // In the JSON a "data" follows cam_K, cam_dist, sensor_calib.
  const auto numbers = [&](const char* section, const char* line, std::size_t count) {
    return json ? numbers_after(text.substr(text.find(section)), "\"data\"", count)
                : numbers_after(text, line, count);
  };
  pair.scene.image = cv::imread((folder / (json ? "0.png" : "calib.jpg")).string());
  pair.scene.points_lidar = read_pcd(folder / (json ? "0.pcd" : "calib.pcd"));
  const auto K = numbers("cam_K", "K:", 9);
  pair.intrinsics = {
      pair.scene.image.cols, pair.scene.image.rows, K[0], K[4], K[2], K[5], "plumb_bob", {}};
  pair.intrinsics.distortion = numbers("cam_dist", "D:", 4);
  pair.T_camera_lidar = transform_of(numbers("sensor_calib", "T:", 12));
  return pair;
}

/// A point where it was when the scanner looked forward, which triggers the camera. It turns from
/// the left to the right ten times a second.
inline Eigen::Vector4f deskewed(const Eigen::Vector4f& point,
                                const Eigen::Vector3d& v_lidar,
                                double yaw_rate_rad_s) {
  const Eigen::Vector3d p = point.head<3>().cast<double>();
  const double after_s = -0.1 * std::atan2(p.y(), p.x()) / (2.0 * std::numbers::pi);
  const geometry::SO3 turn = geometry::SO3::exp({0.0, 0.0, yaw_rate_rad_s * after_s});
  Eigen::Vector4f result = point;
  result.head<3>() = (turn * p + after_s * v_lidar).cast<float>();
  return result;
}

/// One frame of KITTI raw, left colour camera, the cloud deskewed. `date` holds the calibration
/// files.
inline RealPair kitti_frame(const std::filesystem::path& date,
                            const std::string& drive,
                            int frame) {
  RealPair pair;
  char name[16];
  std::snprintf(name, sizeof(name), "%010d", frame);
  const auto folder = date / drive;
  pair.scene.image = cv::imread((folder / "image_02/data" / (std::string(name) + ".jpg")).string());
  std::ifstream file(folder / "velodyne_points/data" / (std::string(name) + ".bin"),
                     std::ios::binary);
  const auto oxts =
      numbers_after(text_of(folder / "oxts/data" / (std::string(name) + ".txt")), "", 20);
  const Eigen::Vector3d v_lidar(oxts[8], oxts[9], 0.0);  // the IMU's axes are nearly the lidar's
  Eigen::Vector4f point;
  while (file.read(reinterpret_cast<char*>(point.data()), 16)) {
    pair.scene.points_lidar.push_back(deskewed(point, v_lidar, oxts[19]));
  }
  const auto camera = text_of(date / "calib_cam_to_cam.txt");
  const auto P = numbers_after(camera, "P_rect_02:", 12);
  pair.intrinsics = {pair.scene.image.cols,
                     pair.scene.image.rows,
                     P[0],
                     P[5],
                     P[2],
                     P[6],
                     "plumb_bob",
                     {0.0, 0.0, 0.0, 0.0, 0.0}};
  const auto R = numbers_after(camera, "R_rect_00:", 9);
  const auto lidar = text_of(date / "calib_velo_to_cam.txt");
  const auto Rv = numbers_after(lidar, "R:", 9);
  const auto tv = numbers_after(lidar, "\nT:", 3);
  const auto rows = [](const std::vector<double>& r, const std::vector<double>& t) {
    return std::vector<double>{
        r[0], r[1], r[2], t[0], r[3], r[4], r[5], t[1], r[6], r[7], r[8], t[2]};
  };
  // P = K [I | t]: where the left colour camera sits in the rectified frame of camera 0.
  const Eigen::Vector3d t02((P[3] - P[2] * P[11]) / P[0], (P[7] - P[6] * P[11]) / P[5], P[11]);
  pair.T_camera_lidar = geometry::SE3(geometry::SO3(), t02) *
                        transform_of(rows(R, {0.0, 0.0, 0.0})) * transform_of(rows(Rv, tv));
  return pair;
}

}  // namespace camvox::test
