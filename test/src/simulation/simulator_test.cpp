#include "camvox/simulation/simulator.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <iostream>
#include <map>

namespace camvox::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

std::vector<Event> collect(const SimulationOptions& options, int threads = 2) {
  Simulator simulator(options, threads);
  std::vector<Event> events;
  while (auto event = simulator.next()) events.push_back(std::move(*event));
  return events;
}

template <typename Message>
std::vector<Message> only(const std::vector<Event>& events) {
  std::vector<Message> messages;
  for (const Event& event : events) {
    if (const auto* message = std::get_if<Message>(&event.message)) messages.push_back(*message);
  }
  return messages;
}

SimulationOptions short_demo(double duration_s) {
  SimulationOptions options = preset("demo");
  options.duration_s = duration_s;
  return options;
}

TEST(Simulator, SensorsAgreeLidarOnDepthTruth) {
  SimulationOptions options = preset("standstill");
  options.duration_s = 0.11;
  options.camera.rate_hz = 5.0;  // One image is enough.
  options.world.people = 0;
  Simulator simulator(options, 2);
  std::vector<Event> events;
  while (auto event = simulator.next()) events.push_back(std::move(*event));
  const auto frames = only<SimulatedFrame>(events);
  const auto scans = only<LidarScan>(events);
  ASSERT_FALSE(frames.empty());
  ASSERT_FALSE(scans.empty());
  const sensors::CameraModel camera(options.intrinsics);
  const geometry::SE3 T_camera_lidar = simulator.true_rig().T_camera_lidar();
  std::vector<double> errors_m;
  std::vector<double> in_sigma;
  for (std::size_t i = 0; i < scans[0].points.size(); ++i) {
    if (scans[0].truth[i].mixed) continue;
    const Vector3d p_camera = T_camera_lidar * scans[0].points[i].p_lidar.cast<double>();
    const auto u_px = camera.project(p_camera);
    if (!u_px || !camera.contains(*u_px, 4.0)) continue;
    const int column = static_cast<int>(std::lround(u_px->x()));
    const int row = static_cast<int>(std::lround(u_px->y()));
    // The pointing noise, 0.05 degrees = 0.84 px, and half a pixel of rounding move the point over
    // the surface: its depth may differ by what the depth image varies over two pixels.
    double low = 1e9, high = 0.0;
    for (int dy = -2; dy <= 2; ++dy) {
      for (int dx = -2; dx <= 2; ++dx) {
        const double z = static_cast<double>(frames[0].depth.at(column + dx, row + dy));
        low = std::min(low, z > 0.0 ? z : 1e9), high = std::max(high, z > 0.0 ? z : 1e9);
      }
    }
    const double outside = std::max({0.0, low - p_camera.z(), p_camera.z() - high});
    errors_m.push_back(outside);
    in_sigma.push_back(outside / 0.02);
  }
  ASSERT_GT(errors_m.size(), 8000u);
  const auto beyond =
      std::count_if(in_sigma.begin(), in_sigma.end(), [](double s) { return s > 3.0; });
  const double share = static_cast<double>(beyond) / static_cast<double>(in_sigma.size());
  std::cout << errors_m.size() << " returns on the depth image, " << 100 * share
            << " % beyond 3 sigma\n";
  // Beyond three sigma: 0.3 % of the noise, plus what camera and lidar, 11 cm apart, see past
  // each other at edges, and pointing errors beyond two pixels (2 %).
  EXPECT_LT(share, 0.04);
}

TEST(Simulator, UndistortedTruthLiesOnTheDepthImageWhileDriving) {
  SimulationOptions options = short_demo(9.5);
  options.world.people = 0;
  options.images = false;
  options.lidar.angle_sigma_deg = 0.0;
  options.lidar.range_sigma_m = 0.0;
  options.lidar.beam_height_deg = options.lidar.beam_width_deg = 0.0;
  Simulator simulator(options, 2);
  LidarScan last;
  while (auto event = simulator.next()) {
    if (const auto* scan = std::get_if<LidarScan>(&event->message)) last = *scan;
  }
  // Noise-free points, moved by the true trajectory to the stamp, are the truth to a millimetre:
  // the coordinates' resolution.
  const geometry::SE3 T_body_lidar = simulator.true_rig().T_body_lidar();
  const double start_s = static_cast<double>(last.stamp_ns - options.start_stamp_ns) * 1e-9;
  const geometry::SE3 T_stamp_world =
      (simulator.trajectory().pose(start_s) * T_body_lidar).inverse();
  double moved = 0.0;
  for (std::size_t i = 0; i < last.points.size(); ++i) {
    const double t = start_s + last.points[i].offset_ns * 1e-9;
    const geometry::SE3 T_stamp_now = T_stamp_world * simulator.trajectory().pose(t) * T_body_lidar;
    const Vector3d p = T_stamp_now * last.points[i].p_lidar.cast<double>();
    EXPECT_LT((p - last.truth[i].p_lidar_stamp.cast<double>()).norm(), 2e-3);
    moved = std::max(moved, (p - last.points[i].p_lidar.cast<double>()).norm());
  }
  EXPECT_GT(moved, 0.15);  // It really was driving.
}

/// Everything in an event that has a value, as bytes.
std::string bytes_of(const std::vector<Event>& events) {
  std::string bytes;
  const auto add = [&](const void* data, std::size_t size) {
    bytes.append(static_cast<const char*>(data), size);
  };
  for (const auto& frame : only<SimulatedFrame>(events)) {
    add(frame.image.rgb.data(), frame.image.rgb.size());
    add(frame.depth.z_m.data(), frame.depth.z_m.size() * sizeof(float));
    add(&frame.stamp_ns, 8);
  }
  for (const auto& scan : only<LidarScan>(events)) {
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      add(scan.points[i].p_lidar.data(), 12);
      add(&scan.points[i].reflectivity, 1);
      add(&scan.points[i].offset_ns, 4);
      add(scan.truth[i].p_lidar_stamp.data(), 12);
    }
  }
  for (const auto& imu : only<ImuSample>(events)) {
    add(imu.omega_rad_s.data(), 24);
    add(imu.force_m_s2.data(), 24);
  }
  for (const Event& event : events) add(&event.arrival_ns, 8);
  return bytes;
}

TEST(Simulator, SameBytesForAnyNumberOfThreads) {
  const SimulationOptions options = short_demo(0.25);
  const std::string one = bytes_of(collect(options, 1));
  EXPECT_GT(one.size(), 10'000'000u);
  EXPECT_TRUE(one == bytes_of(collect(options, 3)));
  SimulationOptions other = options;
  other.seed = 2;
  other.images = false;
  SimulationOptions same = options;
  same.images = false;
  EXPECT_FALSE(bytes_of(collect(same, 2)) == bytes_of(collect(other, 2)));
}

TEST(Simulator, EveryPresetMakesItsFirstMoments) {
  for (const std::string& name : preset_names()) {
    SimulationOptions options = preset(name);
    options.duration_s = 0.12;
    options.camera.rate_hz = 5.0;
    if (name == "dropouts")
      options.faults.image_drop_probability = options.faults.scan_drop_probability = 0.0;
    const auto events = collect(options);
    const auto frames = only<SimulatedFrame>(events);
    const auto scans = only<LidarScan>(events);
    ASSERT_EQ(frames.size(), 1u) << name;
    ASSERT_EQ(scans.size(), 1u) << name;
    const auto shots = 100'000'000 / options.lidar.point_interval_ns;
    EXPECT_GT(scans[0].points.size(), static_cast<std::size_t>(shots / 3)) << name;
    EXPECT_GE(only<TruthState>(events).size(), 120u) << name;
    // The picture shows something: grey levels spread over the range.
    std::map<int, int> histogram;
    for (const auto level : frames[0].image.rgb) ++histogram[level / 16];
    EXPECT_GT(histogram.size(), 8u) << name;
  }
}

TEST(Simulator, PlannedMotionsAreWhatTheyAreCalled) {
  const auto path_length = [](const std::string& name) {
    SimulationOptions options = preset(name);
    options.images = options.scans = false;
    const Simulator simulator(options, 2);
    double length = 0.0;
    double sharpest = 0.0;
    for (double t = 0.0; t < simulator.duration_s(); t += 0.02) {
      const KinematicState state = simulator.trajectory().state(t);
      length += 0.02 * state.v_world.norm();
      sharpest = std::max(sharpest, state.omega_body.norm());
    }
    EXPECT_LT(sharpest, 1.2) << name;
    return length;
  };
  EXPECT_NEAR(path_length("loop_400m"), 400.0, 20.0);
  EXPECT_NEAR(path_length("campus_1800m"), 1800.0, 90.0);
  EXPECT_LT(path_length("standstill"), 1e-6);
  EXPECT_LT(path_length("rotation"), 0.5);
  SimulationOptions demo = preset("demo");
  demo.images = demo.scans = false;
  const double demo_s = Simulator(demo, 1).duration_s();
  EXPECT_GE(demo_s, 60.0);
  EXPECT_LE(demo_s, 90.0);
}

TEST(Simulator, EventsComeInOrderOfArrivalAtTheirRates) {
  SimulationOptions options = short_demo(2.0);
  options.images = options.scans = false;
  const auto events = collect(options);
  for (std::size_t i = 1; i < events.size(); ++i)
    EXPECT_LE(events[i - 1].arrival_ns, events[i].arrival_ns);
  EXPECT_EQ(only<ImuSample>(events).size(), 401u);
  EXPECT_EQ(only<GnssSample>(events).size(), 11u);
  EXPECT_EQ(only<TruthState>(events).size(), 2001u);
  EXPECT_EQ(only<ImuSample>(events)[1].stamp_ns - options.start_stamp_ns, 5'000'000);
}

TEST(Simulator, FaultsLoseAndDelayWhatTheyShould) {
  SimulationOptions options = short_demo(20.0);
  options.images = options.scans = false;
  options.faults.imu_drop_probability = 0.1;
  options.faults.gnss_drop_probability = 0.5;
  options.faults.late_probability = 0.05;
  const auto events = collect(options);
  const auto imu = only<ImuSample>(events);
  // 4001 samples, binomial sigma 19.
  EXPECT_NEAR(static_cast<double>(imu.size()), 3601.0, 95.0);
  int backwards = 0;
  for (std::size_t i = 1; i < imu.size(); ++i) backwards += imu[i].stamp_ns < imu[i - 1].stamp_ns;
  EXPECT_GT(backwards, 50);
  for (std::size_t i = 1; i < events.size(); ++i)
    EXPECT_LE(events[i - 1].arrival_ns, events[i].arrival_ns);
}

TEST(Simulator, OffsetAndJitterMoveStampsNotTruth) {
  SimulationOptions options = short_demo(0.35);
  options.scans = false;
  options.intrinsics.width_px = 64;
  options.intrinsics.height_px = 32;
  options.rig.camera_time_offset_ns = 4'000'000;
  options.faults.trigger_jitter_s = 0.001;
  const auto frames = only<SimulatedFrame>(collect(options));
  ASSERT_EQ(frames.size(), 4u);
  for (const auto& frame : frames) {
    EXPECT_EQ(frame.stamp_ns + 4'000'000, frame.true_stamp_ns);
    const std::int64_t nominal = options.start_stamp_ns + frame.index * 100'000'000;
    EXPECT_NE(frame.true_stamp_ns, nominal);
    EXPECT_LT(std::abs(frame.true_stamp_ns - nominal), 5'000'000);
  }
}

TEST(Simulator, RecordedExtrinsicsHaveTheWantedError) {
  SimulationOptions options = short_demo(0.1);
  options.images = options.scans = false;
  options.extrinsics_error_deg = {0.0, 2.0, 0.0};
  options.extrinsics_error_m = {0.01, 0.0, 0.0};
  const Simulator simulator(options, 2);
  const auto error =
      geometry::local(simulator.true_rig().T_lidar_camera, simulator.recorded_rig().T_lidar_camera);
  EXPECT_NEAR(error.head<3>().norm(), 2.0 * 3.14159265 / 180.0, 1e-6);
}

TEST(Simulator, FollowsAGivenTrajectory) {
  SimulationOptions options = short_demo(0.0);
  options.motion = "given";
  options.images = options.scans = false;
  EXPECT_THROW(Simulator(options, 1), config::ConfigError);
  const std::vector<TimedPose> poses = {{5.0, geometry::SE3()},
                                        {7.0, {geometry::SO3(), {1, 0, 0}}}};
  Simulator simulator(options, 1, follow_poses(poses, 0.1));
  EXPECT_NEAR(simulator.duration_s(), 2.0, 1e-9);
}

TEST(Simulator, BadOptionsGiveAllProblems) {
  SimulationOptions options;
  options.seed = -1;
  options.world.kind = "plaza";  // loop_400m needs the campus.
  options.camera.gain = 0.0;
  options.rig.T_imu_lidar.translation_m = {};
  options.intrinsics.distortion = std::vector<double>(9, 0.0);
  options.extrinsics_error_m = {1.0};
  try {
    const Simulator simulator(options);
    FAIL();
  } catch (const config::ConfigError& error) {
    EXPECT_EQ(error.problems().size(), 6u) << error.what();
    EXPECT_THAT(error.what(), HasSubstr("camera.gain"));
    EXPECT_THAT(error.what(), HasSubstr("loop_400m does not fit world.kind plaza"));
    EXPECT_THAT(error.what(), HasSubstr("rig.T_imu_lidar.translation_m"));
    EXPECT_THAT(error.what(), HasSubstr("intrinsics.distortion"));
  }
  EXPECT_THROW((void)preset("demmo"), config::ConfigError);
}

}  // namespace
}  // namespace camvox::simulation
