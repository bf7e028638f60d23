#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "camvox/calibration_component/calibration_job.hpp"
#include "camvox/calibration_component/scene_collector.hpp"
#include "camvox/component/component.hpp"
#include "camvox/component/progress.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/std_msgs.hpp"
#include "camvox/sensors/rig.hpp"

namespace camvox {

/// Parameters of CalibrationComponent. YAML keys are the field names.
struct CalibrationComponentConfig {
  bool automatic = true;         ///< Calibrate at each new standstill.
  std::int64_t request = 0;      ///< Set to another number to calibrate at the next standstill.
  double collect_s = 4.0;        ///< Time for which scans are accumulated.
  double min_interval_s = 60.0;  ///< Between automatic calibrations.
  std::string rig_file;          ///< Written when a result is accepted; empty: none.
  std::string output_dir;        ///< For calibration.yaml and pictures; empty: none.
  bool lockstep = false;         ///< Compute at once, and only propose.
  calibration::CalibrationConfig calibration;
  sensors::CameraIntrinsics camera;
  sensors::RigConfig rig;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("automatic", self.automatic);
    field("request", self.request);
    field("collect_s", self.collect_s, config::greater_than(0.0), config::at_most(30.0));
    field("min_interval_s", self.min_interval_s, config::at_least(0.0));
    field("rig_file", self.rig_file);
    field("output_dir", self.output_dir);
    field("lockstep", self.lockstep);
    field("calibration", self.calibration);
    field("camera", self.camera);
    field("rig", self.rig);
  }
};

/// Calibrates lidar and camera while the robot stands still: keeps one image and the returns of
/// some seconds, and computes on a thread of its own, so that nothing waits for it. Motion cancels
/// at once. A result that passes the gate is published as the extrinsics in force (latched,
/// versioned), any other one as a proposal (applied = 0), after which those in force are repeated.
/// They stay in force when it is made anew after an error.
///
/// In lockstep it computes while the replay waits, and every result is a proposal: from which frame
/// on depth projection would take it over depends on timing, and a run must give the same bytes
/// each time. The next run gets it by `--parameters calibration.yaml`.
///
/// In `output_dir`: calibration.yaml, a parameter file with the extrinsics after the verdict (which
/// stands above them), calibration_before.png and calibration_after.png.
class CalibrationComponent final : public Component {
 public:
  explicit CalibrationComponent(Context& context);
  ~CalibrationComponent() override { job_.wait(); }
  void start() override;
  void stop() override { job_.wait(); }

 private:
  using Cloud = camvox_interfaces::msg::Cloud;
  using FrameImage = camvox_interfaces::msg::FrameImage;
  using Extrinsics = camvox_interfaces::msg::Extrinsics;

  /// Image and cloud of one frame come in any order.
  template <typename Message>
  void keep(std::map<std::uint64_t, Sample<Message>>& frames, const Sample<Message>& sample);
  void put_in_force(const Extrinsics& extrinsics);
  void add(const FrameImage& image, const Cloud& cloud);
  void cancel();
  [[nodiscard]] bool wanted(std::int64_t stamp_ns) const;
  void calibrate(const camvox_interfaces::msg::MessageHeader& header);
  void finish(std::uint64_t run, const calibration::CalibrationResult& result);
  void publish(const calibration::CalibrationResult& result);
  void save(const calibration::CalibrationResult& result);

  Context& context_;
  CalibrationComponentConfig config_;
  sensors::RigCalibration rig_;
  geometry::SE3 T_camera_lidar_;
  ProgressReporter progress_;
  Publisher<Extrinsics> extrinsics_;
  std::optional<Extrinsics> in_force_;
  bool requested_ = false;
  bool done_here_ = false;  ///< This standstill has had its calibration.
  std::map<std::uint64_t, Sample<FrameImage>> images_;
  std::map<std::uint64_t, Sample<Cloud>> clouds_;
  std::optional<std::int64_t> last_run_ns_;
  calibration_component::SceneCollector scene_;
  camvox_interfaces::msg::MessageHeader header_;
  std::uint64_t run_ = 0;  ///< Raised by each start and each cancellation.
  std::uint64_t accepted_ = 0;
  std::uint64_t refused_ = 0;
  std::uint64_t cancelled_ = 0;
  calibration_component::CalibrationJob job_;
};

}  // namespace camvox
