#include "camvox/calibration_component/calibration_job.hpp"

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "camvox/calibration/overlay.hpp"

namespace camvox::calibration_component {
namespace {

void write_pictures(const CalibrationTask& task, const calibration::CalibrationResult& result) {
  const std::filesystem::path folder = task.picture_folder;
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  const auto write = [&](const char* name, const geometry::SE3& T_camera_lidar) {
    try {
      cv::imwrite(folder / name,
                  calibration::draw_overlay(
                      task.scene, task.camera, T_camera_lidar, task.config.lidar_edges));
    } catch (const cv::Exception&) {
      return;  // a picture that cannot be written spoils no calibration
    }
  };
  write("before.png", task.T_camera_lidar);
  write("after.png", result.T_camera_lidar);
}

}  // namespace

void CalibrationJob::start(CalibrationTask task, Done done) {
  if (busy_.exchange(true)) throw std::logic_error("CalibrationJob: a calibration is under way");
  thread_ = std::jthread(
      [this, task = std::move(task), done = std::move(done)](const std::stop_token& stop) {
        calibration::CalibrationResult result;
        try {
          result = calibration::calibrate(
              {task.scene}, task.camera, task.T_camera_lidar, task.config, stop);
          const bool finished = result.status == calibration::CalibrationStatus::kDone;
          if (finished && !task.picture_folder.empty()) write_pictures(task, result);
        } catch (const std::exception& error) {
          result.reason = error.what();
        }
        busy_ = false;  // before `done` tells, so that who is told may start the next
        done(result);
      });
}

}  // namespace camvox::calibration_component
