#include "camvox/simulation/simulator.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <queue>
#include <stdexcept>
#include <utility>

#include "camvox/simulation/camera_renderer.hpp"
#include "motions.hpp"

namespace camvox::simulation {
namespace {

using Eigen::Vector3d;

constexpr double kNanoseconds = 1e9;
constexpr std::uint64_t kGnssStream = 30;
constexpr std::uint64_t kFaultStream = 40;
constexpr std::uint64_t kJitterStream = 50;
/// Where driver and wire hold an image after its last row was exposed.
constexpr std::int64_t kImageLatency_ns = 5'000'000;

enum Sensor : std::uint32_t { kTruth, kImu, kGnss, kCamera, kLidar, kSensors };

SimulationOptions checked(const SimulationOptions& options, bool has_motion) {
  auto problems = check(options);
  if ((options.motion == "given") != has_motion) {
    problems.push_back({{"simulation", 0},
                        "motion",
                        "a trajectory must be given for motion 'given', and only then"});
  }
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
  return options;
}

/// A message that was sent and is on its way; images and scans are made when they arrive.
struct Pending {
  std::int64_t arrival_ns;
  Sensor sensor;
  std::int64_t index;
  std::optional<ImuSample> imu;

  bool operator>(const Pending& other) const {
    return std::tie(arrival_ns, sensor, index) >
           std::tie(other.arrival_ns, other.sensor, other.index);
  }
};

/// What looks at the world, slow to set up.
struct Optics {
  SurfaceShader shader;
  RayScene scene;
  CameraRenderer renderer;
  LidarScanner scanner;

  Optics(const SimulationOptions& options, const World& world, int threads)
      : shader(world.seed, threads),
        scene(world),
        renderer(sensors::CameraModel(options.intrinsics), options.camera, world, shader),
        scanner(options.lidar, static_cast<std::uint64_t>(options.seed), shader) {}
  // The renderer and the scanner point to the shader.
  Optics(const Optics&) = delete;
  Optics& operator=(const Optics&) = delete;
};

}  // namespace

struct Simulator::Implementation {
  SimulationOptions options;
  int threads;
  sensors::RigCalibration rig;
  World world;
  Trajectory trajectory;
  double duration_s;
  std::optional<Optics> optics;  ///< Only if a sensor looks at the world.
  ImuErrors imu_errors;
  std::array<std::int64_t, kSensors> next_index{};
  std::priority_queue<Pending, std::vector<Pending>, std::greater<>> pending;

  Implementation(const SimulationOptions& wanted, int thread_count, std::optional<Trajectory> given)
      : options(checked(wanted, given.has_value())),
        threads(thread_count),
        rig(sensors::make_rig_calibration(options.rig)),
        world(make_world(options.world)),
        trajectory(given ? *std::move(given) : make_motion(options, world)),
        duration_s(options.duration_s > 0.0 ? std::min(options.duration_s, trajectory.duration_s())
                                            : trajectory.duration_s()),
        imu_errors(options.imu, options.imu_rate_hz, seed()) {
    if (options.images || options.scans) optics.emplace(options, world, threads);
  }

  [[nodiscard]] std::uint64_t seed() const { return static_cast<std::uint64_t>(options.seed); }

  [[nodiscard]] double rate_hz(Sensor sensor) const {
    switch (sensor) {
      case kTruth:
        return options.truth_rate_hz;
      case kImu:
        return options.imu_rate_hz;
      case kGnss:
        return options.gnss_rate_hz;
      case kCamera:
        return options.camera.rate_hz;
      default:
        return options.lidar_rate_hz;
    }
  }

  /// Nominal time of a sensor's message, ns since the start.
  [[nodiscard]] std::int64_t time_ns(Sensor sensor, std::int64_t index) const {
    return std::llround(static_cast<double>(index) * kNanoseconds / rate_hz(sensor));
  }

  /// True time of an image: trigger jitter included.
  [[nodiscard]] std::int64_t image_time_ns(std::int64_t index) const {
    const CounterRandom random(seed(), kJitterStream);
    const double jitter_s =
        options.faults.trigger_jitter_s * random.normal(static_cast<std::uint64_t>(index));
    return time_ns(kCamera, index) + std::llround(jitter_s * kNanoseconds);
  }

  [[nodiscard]] bool enabled(Sensor sensor) const {
    return (sensor != kCamera || options.images) && (sensor != kLidar || options.scans);
  }

  [[nodiscard]] double drop_probability(Sensor sensor) const {
    const std::array<double, kSensors> probability = {0.0,
                                                      options.faults.imu_drop_probability,
                                                      options.faults.gnss_drop_probability,
                                                      options.faults.image_drop_probability,
                                                      options.faults.scan_drop_probability};
    return probability[sensor];
  }

  /// How long a message takes when it is not late.
  [[nodiscard]] std::int64_t latency_ns(Sensor sensor) const {
    if (sensor == kLidar) return time_ns(kLidar, 1);
    if (sensor != kCamera) return 0;
    const double open_s =
        options.camera.row_time_s * options.intrinsics.height_px + 0.5 * options.camera.exposure_s;
    return kImageLatency_ns + std::llround(open_s * kNanoseconds);
  }

  /// Sends a sensor's next message on its way, or loses it.
  void send(Sensor sensor) {
    const std::int64_t index = next_index[sensor]++;
    Pending message{time_ns(sensor, index) + latency_ns(sensor), sensor, index, std::nullopt};
    if (sensor == kImu) message.imu = imu_sample(index);
    const CounterRandom random(seed(), kFaultStream + sensor);
    const auto counter = static_cast<std::uint64_t>(index);
    if (random.uniform(counter, 0) < drop_probability(sensor)) return;
    if (sensor != kTruth && random.uniform(counter, 1) < options.faults.late_probability) {
      message.arrival_ns += std::llround(options.faults.late_by_s * kNanoseconds);
    }
    pending.push(std::move(message));
  }

  /// Sends all that could arrive before what is first in the queue.
  void fill_queue() {
    for (std::uint32_t i = 0; i < kSensors; ++i) {
      const auto sensor = static_cast<Sensor>(i);
      while (enabled(sensor)) {
        const std::int64_t next_ns = time_ns(sensor, next_index[sensor]);
        // A scan must end within the motion, everything else must begin in it.
        const std::int64_t end_ns = sensor == kLidar ? next_ns + latency_ns(kLidar) : next_ns;
        if (static_cast<double>(end_ns) > duration_s * kNanoseconds) break;
        if (!pending.empty() && next_ns + latency_ns(sensor) > pending.top().arrival_ns) break;
        send(sensor);
      }
    }
  }

  [[nodiscard]] std::int64_t stamp(std::int64_t since_start_ns) const {
    return options.start_stamp_ns + since_start_ns;
  }

  ImuSample imu_sample(std::int64_t index) {
    const std::int64_t time = time_ns(kImu, index);
    ImuSample sample = imu_errors.next(
        ideal_imu(trajectory.state(static_cast<double>(time) / kNanoseconds), rig.T_body_imu()));
    sample.stamp_ns = stamp(time) - rig.imu_time_offset_ns;
    return sample;
  }

  [[nodiscard]] GnssSample gnss_sample(std::int64_t index) const {
    const CounterRandom random(seed(), kGnssStream);
    const std::int64_t time = time_ns(kGnss, index);
    const auto counter = static_cast<std::uint64_t>(index);
    GnssSample sample;
    sample.stamp_ns = stamp(time);
    sample.p_world_true =
        trajectory.pose(static_cast<double>(time) / kNanoseconds) * rig.p_body_gnss;
    sample.p_world =
        sample.p_world_true + options.gnss_sigma_m * Vector3d(random.normal(counter, 0),
                                                              random.normal(counter, 1),
                                                              random.normal(counter, 2));
    sample.fix =
        from_enu({options.latitude_deg, options.longitude_deg, options.altitude_m}, sample.p_world);
    sample.sigma_m = options.gnss_sigma_m;
    return sample;
  }

  [[nodiscard]] SimulatedFrame frame(std::int64_t index) {
    const std::int64_t time = image_time_ns(index);
    const double time_s = static_cast<double>(time) / kNanoseconds;
    const auto pose = [this](double t) { return trajectory.pose(t) * rig.T_body_camera; };
    Rendering rendering = optics->renderer.render(
        optics->scene, {static_cast<std::uint64_t>(index), seed(), time_s, pose}, threads);
    return {stamp(time) - rig.camera_time_offset_ns,
            index,
            std::move(rendering.image),
            std::move(rendering.depth),
            pose(time_s),
            stamp(time)};
  }

  [[nodiscard]] LidarScan scan(std::int64_t index) {
    const auto pose = [this](double t) { return trajectory.pose(t) * rig.T_body_lidar(); };
    const std::int64_t start = time_ns(kLidar, index);
    LidarScan result = optics->scanner.scan(
        optics->scene, {start, time_ns(kLidar, index + 1) - start, pose}, threads);
    result.stamp_ns = stamp(start);
    return result;
  }

  [[nodiscard]] TruthState truth(std::int64_t index) const {
    const std::int64_t time = time_ns(kTruth, index);
    return {stamp(time), trajectory.state(static_cast<double>(time) / kNanoseconds)};
  }
};

Simulator::Simulator(const SimulationOptions& options, int threads, std::optional<Trajectory> given)
    : implementation_(
          std::make_unique<Implementation>(options, std::max(threads, 1), std::move(given))) {}
Simulator::~Simulator() = default;
Simulator::Simulator(Simulator&&) noexcept = default;
Simulator& Simulator::operator=(Simulator&&) noexcept = default;

std::optional<Event> Simulator::next() {
  Implementation& own = *implementation_;
  own.fill_queue();
  if (own.pending.empty()) return std::nullopt;
  const Pending message = own.pending.top();
  own.pending.pop();
  Event event;
  event.arrival_ns = own.stamp(message.arrival_ns);
  switch (message.sensor) {
    case kImu:
      event.message = *message.imu;
      break;
    case kGnss:
      event.message = own.gnss_sample(message.index);
      break;
    case kCamera:
      event.message = own.frame(message.index);
      break;
    case kLidar:
      event.message = own.scan(message.index);
      break;
    default:
      event.message = own.truth(message.index);
      break;
  }
  return event;
}

double Simulator::duration_s() const { return implementation_->duration_s; }
const Trajectory& Simulator::trajectory() const { return implementation_->trajectory; }
const World& Simulator::world() const { return implementation_->world; }
const sensors::RigCalibration& Simulator::true_rig() const { return implementation_->rig; }

sensors::RigCalibration Simulator::recorded_rig() const {
  const SimulationOptions& options = implementation_->options;
  sensors::RigCalibration rig = implementation_->rig;
  const Vector3d angle =
      Eigen::Map<const Vector3d>(options.extrinsics_error_deg.data()) * std::numbers::pi / 180.0;
  const Vector3d shift = Eigen::Map<const Vector3d>(options.extrinsics_error_m.data());
  rig.T_lidar_camera = rig.T_lidar_camera * geometry::SE3(geometry::SO3::exp(angle), shift);
  return rig;
}

}  // namespace camvox::simulation
