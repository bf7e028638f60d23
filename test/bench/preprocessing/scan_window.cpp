// Which part of the lidar stream to take for an image: `before`, `centred` or `after`? Deskews
// scans of rigs in known motion with what the live system has when the scan is complete: a noisy
// IMU, and odometry up to the frame before. Prints the residual at 30 m and the latency.
#include <algorithm>
#include <cstdio>

#include "camvox/lidar/deskew.hpp"
#include "camvox/lidar/inertial_motion.hpp"
#include "camvox/test/moving_rig.hpp"

namespace camvox {
namespace {

using geometry::SE3;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kFrame_ns = 100 * kMs;
constexpr double kTracking_s = 0.035;  // from a complete scan to the frame's pose

struct Setup {
  const char* window;
  std::int64_t begin_ns;  ///< Of the scan, from the image.
  bool use_imu;
};

struct Outcome {
  double rms_m = 0.0;
  double p95_m = 0.0;  ///< Of the rms of one scan.
};

lidar::ScanMotion motion_of(const lidar::InertialMotionFilter& filter,
                            const SE3& T_last_step_imu,
                            const lidar::ScanInterval& interval,
                            const test::MovingRig& rig,
                            bool use_imu) {
  if (use_imu) {
    return lidar::inertial_scan_motion(filter.track(),
                                       filter.gyro_bias_rad_s(),
                                       filter.predict(interval.image_ns),
                                       interval,
                                       rig.rig().T_imu_lidar);
  }
  return lidar::constant_scan_motion(10.0 * T_last_step_imu.log(), interval, rig.rig().T_imu_lidar);
}

Outcome run(const test::MovingRig& rig, const Setup& setup, std::uint64_t seed) {
  lidar::InertialMotionFilter filter({});
  const auto readings = rig.imu(0, 31'000 * kMs, {}, seed);
  auto next = readings.begin();
  std::vector<double> scans_m;
  for (std::int64_t image_ns = 2 * kFrame_ns; image_ns < 30'000 * kMs; image_ns += kFrame_ns) {
    const std::int64_t known_ns = image_ns - kFrame_ns;
    for (; next->stamp_ns <= image_ns + kFrame_ns; ++next) filter.add_reading(*next);
    const SE3 T_true = rig.T_world_imu(known_ns - kFrame_ns).inverse() * rig.T_world_imu(known_ns);
    const SE3 T_step = test::noisy_step(
        T_true, 0.005, 0.0005, seed * 100'000 + static_cast<std::uint64_t>(image_ns / kFrame_ns));
    filter.add_odometry({known_ns - kFrame_ns, known_ns, T_step});
    if (image_ns < 5'000 * kMs) continue;
    const auto scan = rig.scan(image_ns + setup.begin_ns, image_ns, 500);
    const lidar::ScanInterval interval{scan.stamp_ns, scan.stamp_ns + kFrame_ns, image_ns};
    const auto motion = motion_of(filter, T_step, interval, rig, setup.use_imu);
    std::vector<std::array<float, 4>> moved(scan.points.size());
    motion.apply({reinterpret_cast<const float(*)[4]>(scan.points.data()), moved.size()},
                 scan.offset_ns,
                 scan.stamp_ns,
                 {reinterpret_cast<float(*)[4]>(moved.data()), moved.size()});
    scans_m.push_back(test::rms_error_m(moved, scan));
  }
  Outcome outcome;
  for (const double error_m : scans_m) outcome.rms_m += error_m * error_m;
  outcome.rms_m = std::sqrt(outcome.rms_m / static_cast<double>(scans_m.size()));
  std::ranges::sort(scans_m);
  outcome.p95_m = scans_m[scans_m.size() * 95 / 100];
  return outcome;
}

void compare(const char* name, const test::MovingRig& rig) {
  std::printf("\n%s\n%-8s %-9s %16s %16s %12s\n",
              name,
              "window",
              "IMU",
              "rms mm (spread)",
              "p95 mm (spread)",
              "pose after ms");
  for (const bool use_imu : {true, false}) {
    for (const Setup& setup : {Setup{"before", -kFrame_ns, use_imu},
                               Setup{"centred", -kFrame_ns / 2, use_imu},
                               Setup{"after", 0, use_imu}}) {
      std::vector<double> rms_mm, p95_mm;
      for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        const auto outcome = run(rig, setup, seed);
        rms_mm.push_back(1e3 * outcome.rms_m);
        p95_mm.push_back(1e3 * outcome.p95_m);
      }
      std::ranges::sort(rms_mm);
      std::ranges::sort(p95_mm);
      std::printf("%-8s %-9s %8.1f (%4.1f) %9.1f (%4.1f) %12.0f\n",
                  setup.window,
                  use_imu ? "yes" : "no",
                  rms_mm[2],
                  rms_mm[4] - rms_mm[0],
                  p95_mm[2],
                  p95_mm[4] - p95_mm[0],
                  1e-6 * static_cast<double>(setup.begin_ns + kFrame_ns) + 1e3 * kTracking_s);
    }
  }
}

}  // namespace
}  // namespace camvox

int main() {
  std::printf(
      "Residual of the deskew at 30 m; median and spread over 5 seeds of IMU and odometry "
      "noise.\nOdometry: frame before, 5 mm and 0.5 mrad a step. IMU: 200 Hz, default noise.\n");
  camvox::compare("driving, 2 m/s and 1 rad/s", camvox::test::MovingRig::driving(32.0));
  camvox::compare("handheld, up to 2 m/s and 1 rad/s, 8 m/s^2",
                  camvox::test::MovingRig::handheld(32.0));
}
