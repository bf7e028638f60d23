#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <variant>

#include "camvox/simulation/geodetic.hpp"
#include "camvox/simulation/inertial.hpp"
#include "camvox/simulation/lidar_scanner.hpp"
#include "camvox/simulation/options.hpp"
#include "camvox/simulation/trajectory.hpp"

namespace camvox::simulation {

/// An image as the camera driver sends it, with its truth.
struct SimulatedFrame {
  std::int64_t stamp_ns = 0;  ///< What the driver says.
  std::int64_t index = 0;     ///< Number of the trigger, dropped images included.
  ColorImage image;
  DepthImage depth;                ///< Truth, pixel by pixel.
  geometry::SE3 T_world_camera;    ///< Truth, at the true time of the first row.
  std::int64_t true_stamp_ns = 0;  ///< Truth: middle of the first row's exposure, lidar clock.
};

/// A GNSS-RTK fix.
struct GnssSample {
  std::int64_t stamp_ns = 0;
  Geodetic fix;
  Eigen::Vector3d p_world;  ///< The same as east, north, up of the world's origin.
  double sigma_m = 0.0;
  Eigen::Vector3d p_world_true;  ///< Truth.
};

/// The true state of the body.
struct TruthState {
  std::int64_t stamp_ns = 0;
  KinematicState body;
};

/// A message and when it arrives, on the clock of the stamps.
struct Event {
  std::int64_t arrival_ns = 0;
  std::variant<SimulatedFrame, LidarScan, ImuSample, GnssSample, TruthState> message;
};

/// Makes a recording, message by message, in the order of arrival. Memory does not grow with the
/// length of the recording. The same options give the same bytes on any number of threads; on
/// processors with other vector units the last bits of ray casting may differ.
class Simulator {
 public:
  /// Builds the world. `given` is the motion when options.motion is "given". Throws
  /// config::ConfigError with all problems of `options`.
  explicit Simulator(const SimulationOptions& options,
                     int threads = 1,
                     std::optional<Trajectory> given = std::nullopt);
  ~Simulator();
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;

  /// The next message; nothing at the end.
  [[nodiscard]] std::optional<Event> next();

  [[nodiscard]] double duration_s() const;
  [[nodiscard]] const Trajectory& trajectory() const;
  [[nodiscard]] const World& world() const;
  /// Where the sensors really are.
  [[nodiscard]] const sensors::RigCalibration& true_rig() const;
  /// What a recording says: the truth plus the extrinsics error of the options.
  [[nodiscard]] sensors::RigCalibration recorded_rig() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace camvox::simulation
