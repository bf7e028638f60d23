#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>

#include "camvox/calibration/calibrator.hpp"

namespace camvox::calibration_component {

/// One calibration to do.
struct CalibrationTask {
  calibration::Scene scene;
  sensors::CameraIntrinsics camera;
  geometry::SE3 T_camera_lidar;
  calibration::CalibrationConfig config;
  std::string picture_folder;  ///< For calibration_before.png and _after.png; "": none.
};

/// Calibrates and draws the pictures. A task that fails has a result without numbers.
[[nodiscard]] calibration::CalibrationResult perform(const CalibrationTask& task,
                                                     const std::stop_token& stop = {});

/// Runs calibrations on a thread of its own, one at a time.
class CalibrationJob {
 public:
  /// `done` gets the result on that thread.
  using Done = std::function<void(const calibration::CalibrationResult&)>;

  ~CalibrationJob() { cancel(); }

  /// Only while not busy.
  void start(CalibrationTask task, Done done);
  /// Asks the present one to end; it does within some tens of milliseconds.
  void cancel() { thread_.request_stop(); }
  void wait() {
    cancel();
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] bool busy() const { return busy_; }

 private:
  std::atomic<bool> busy_ = false;
  std::jthread thread_;
};

}  // namespace camvox::calibration_component
