#include "camvox/calibration_component/calibration_job.hpp"

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "camvox/calibration/overlay.hpp"
#include "camvox/component/background_thread.hpp"

namespace camvox::calibration_component {
namespace {

void write_pictures(const CalibrationTask& task,
                    const calibration::CalibrationResult& result,
                    const std::stop_token& stop) {
  const std::filesystem::path folder = task.picture_folder;
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  const auto write = [&](const char* name, const geometry::SE3& T_camera_lidar) {
    if (stop.stop_requested()) return;
    try {
      cv::imwrite(folder / name,
                  calibration::draw_overlay(
                      task.scene, task.camera, T_camera_lidar, task.config.lidar_edges));
    } catch (const cv::Exception&) {
      return;  // a picture that cannot be written spoils no calibration
    }
  };
  write("calibration_before.png", task.T_camera_lidar);
  write("calibration_after.png", result.T_camera_lidar);
}

}  // namespace

calibration::CalibrationResult perform(const CalibrationTask& task, const std::stop_token& stop) {
  calibration::CalibrationResult result;
  try {
    result =
        calibration::calibrate({task.scene}, task.camera, task.T_camera_lidar, task.config, stop);
    const bool finished = result.status == calibration::CalibrationStatus::kDone;
    if (finished && !task.picture_folder.empty()) write_pictures(task, result, stop);
  } catch (const std::exception& error) {
    result.reason = error.what();
  }
  return result;
}

void CalibrationJob::start(CalibrationTask task, Done done) {
  if (busy_.exchange(true)) throw std::logic_error("CalibrationJob: a calibration is under way");
  thread_ = std::jthread(
      [this, task = std::move(task), done = std::move(done)](const std::stop_token& stop) {
        make_background_thread();
        const auto result = perform(task, stop);
        busy_ = false;  // before `done` tells, so that who is told may start the next
        done(result);
      });
}

}  // namespace camvox::calibration_component
