#include "bench_case.hpp"

#include <filesystem>
#include <fstream>
#include <functional>

#include "real_pairs.hpp"
#include "simulated_stop.hpp"

namespace camvox::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kSeconds = 4;

const std::vector<test::Stop> kStops = {{"plaza", 1, -22, -9, 0.35},  // as preset `standstill`
                                        {"plaza", 1, 18, -12, 1.57},
                                        {"plaza", 2, 18, 10, 3.1},
                                        {"plaza", 3, -18, 10, -1.2},
                                        {"campus", 1, 10, -1.2, 0.0},
                                        {"campus", 1, 70, -1.2, 0.2},
                                        {"campus", 2, 20, -1.2, 0.0},
                                        {"campus", 3, 1.2, 30, 1.57},
                                        {"street", 1, 10, -1.2, 0.0},
                                        {"street", 2, 40, -1.2, 0.0},
                                        {"corridor", 1, 6, 0, 0.0},
                                        {"corridor", 2, 20, 0, 3.1}};

fs::path cache_file(const test::Stop& stop) {
  std::string name = stop.world + "_" + std::to_string(stop.seed);
  for (const double value : {stop.x_m, stop.y_m, stop.yaw_rad}) {
    name += "_" + std::to_string(static_cast<int>(value * 100.0));
  }
  return fs::path(SCENE_CACHE) / (name + ".scene");
}

void write_scene(const fs::path& path, const calibration::Scene& scene) {
  fs::create_directories(path.parent_path());
  const fs::path part = path.string() + ".part";  // two benchmarks may render at a time
  std::ofstream file(part, std::ios::binary);
  const std::int64_t sizes[3] = {
      scene.image.cols, scene.image.rows, static_cast<std::int64_t>(scene.points_lidar.size())};
  file.write(reinterpret_cast<const char*>(sizes), sizeof(sizes));
  file.write(reinterpret_cast<const char*>(scene.image.data),
             static_cast<std::streamsize>(scene.image.total() * 3));
  file.write(reinterpret_cast<const char*>(scene.points_lidar.data()),
             static_cast<std::streamsize>(scene.points_lidar.size() * sizeof(Eigen::Vector4f)));
  file.close();
  fs::rename(part, path);
}

calibration::Scene read_scene(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::int64_t sizes[3] = {};
  file.read(reinterpret_cast<char*>(sizes), sizeof(sizes));
  calibration::Scene scene;
  scene.image.create(static_cast<int>(sizes[1]), static_cast<int>(sizes[0]), CV_8UC3);
  scene.points_lidar.resize(static_cast<std::size_t>(sizes[2]));
  file.read(reinterpret_cast<char*>(scene.image.data),
            static_cast<std::streamsize>(scene.image.total() * 3));
  file.read(reinterpret_cast<char*>(scene.points_lidar.data()),
            static_cast<std::streamsize>(scene.points_lidar.size() * sizeof(Eigen::Vector4f)));
  if (!file) throw std::runtime_error(path.string() + ": broken; delete it");
  return scene;
}

BenchCase case_of(std::string name, test::RealPair pair) {
  BenchCase result{std::move(name), {}, pair.intrinsics, pair.T_camera_lidar};
  result.scenes.push_back(std::move(pair.scene));
  return result;
}

BenchCase kitti_group(const fs::path& kitti, const std::string& drive, int first) {
  BenchCase group;
  for (int k = 0; k < 10; ++k) {
    auto pair = test::kitti_frame(kitti, drive, first + 14 * k);
    group.intrinsics = pair.intrinsics;
    group.T_camera_lidar = pair.T_camera_lidar;
    group.scenes.push_back(std::move(pair.scene));
  }
  group.name = "KITTI 10 frames from " + std::to_string(first);
  return group;
}

std::vector<std::function<BenchCase()>> real_makers() {
  std::vector<std::function<BenchCase()>> makers;
  const fs::path pairs = fs::path(SHARED_DATA) / "lidar_camera_pairs";
  const fs::path kitti = fs::path(SHARED_DATA) / "kitti_0013";
  const std::string drive = "2011_09_26_drive_0013_sync";
  if (fs::exists(pairs)) {
    for (const char which : {'a', 'b'}) {
      makers.emplace_back(
          [=] { return case_of(std::string("junction_") + which, test::junction(pairs, which)); });
    }
  }
  if (!fs::exists(kitti)) return makers;
  for (const int frame : {0, 35, 70, 105, 140}) {
    makers.emplace_back([=] {
      return case_of("KITTI frame " + std::to_string(frame),
                     test::kitti_frame(kitti, drive, frame));
    });
  }
  for (const int first : {0, 5, 10}) {
    makers.emplace_back([=] { return kitti_group(kitti, drive, first); });
  }
  return makers;
}

}  // namespace

std::size_t synthetic_count() { return kStops.size(); }

BenchCase synthetic_case(std::size_t index) {
  const test::Stop& stop = kStops.at(index);
  const fs::path path = cache_file(stop);
  if (!fs::exists(path)) write_scene(path, test::look_from(stop, kSeconds));
  return {stop.world + " " + std::to_string(index),
          {read_scene(path)},
          sensors::CameraIntrinsics{},
          test::true_T_camera_lidar()};
}

std::size_t real_count() { return real_makers().size(); }

BenchCase real_case(std::size_t index) { return real_makers().at(index)(); }

}  // namespace camvox::bench
