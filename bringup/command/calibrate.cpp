#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <exception>
#include <filesystem>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "calibration_scene.hpp"
#include "camvox/bringup/parameter_file.hpp"
#include "camvox/calibration/calibrator.hpp"
#include "camvox/calibration/overlay.hpp"
#include "camvox/calibration_component/rig_file.hpp"
#include "camvox/sensors/rig.hpp"
#include "command.hpp"
#include "signals.hpp"

namespace camvox::command {
namespace {

namespace fs = std::filesystem;
using calibration::CalibrationResult;
using calibration::CalibrationStatus;

struct CalibrateOptions {
  std::string parameters;
  std::string output;
  SceneOptions scene;
};

/// Camera and rig are required, `calibration` may tune the method; the rest of the file is of no
/// matter here.
struct CalibrateConfig {
  sensors::CameraIntrinsics camera;
  sensors::RigConfig rig;
  calibration::CalibrationConfig calibration;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("camera", self.camera);
    field("rig", self.rig);
    field("calibration", self.calibration);
  }
};

/// Throws config::ConfigError with all that is wrong.
CalibrateConfig read_config(const std::string& file) {
  std::vector<config::Problem> problems;
  auto parameters = bringup::read_parameter_file(file, problems);
  std::erase_if(parameters, [](const auto& parameter) {
    const auto group = parameter.first.substr(0, parameter.first.find('.'));
    return group != "camera" && group != "rig" && group != "calibration";
  });
  CalibrateConfig result;
  for (auto& problem : config::load(parameters, result)) problems.push_back(std::move(problem));
  for (auto& problem : sensors::check(result.camera)) problems.push_back(std::move(problem));
  for (auto& problem : sensors::check(result.rig)) problems.push_back(std::move(problem));
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
  return result;
}

/// Calibrates on a thread of its own, so that a signal ends it.
CalibrationResult calibrate_until_signal(const calibration::Scene& scene,
                                         const CalibrateConfig& config,
                                         const geometry::SE3& T_camera_lidar) {
  StopSignal signal;
  CalibrationResult result;
  std::exception_ptr error;
  std::jthread worker([&](const std::stop_token& stop) {
    try {
      result =
          calibration::calibrate({scene}, config.camera, T_camera_lidar, config.calibration, stop);
    } catch (...) {
      error = std::current_exception();
    }
    signal.request();
  });
  signal.wait();
  worker.request_stop();
  worker.join();
  if (error) std::rethrow_exception(error);
  return result;
}

void write_picture(const fs::path& file, const cv::Mat& picture) {
  bool written = false;
  try {
    written = cv::imwrite(file, picture);
  } catch (const cv::Exception&) {
    written = false;
  }
  if (!written) throw CommandError(file.string() + ": cannot be written");
}

/// The rig with the lidar moved; the camera stays where it is on the robot.
void write_results(const CalibrateOptions& options,
                   const CalibrateConfig& config,
                   const calibration::Scene& scene,
                   const CalibrationResult& result) {
  auto rig = sensors::make_rig_calibration(config.rig);
  const auto before = rig.T_camera_lidar();
  const fs::path folder = options.output;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw CommandError(folder.string() + ": " + error.message());
  const auto overlay = [&](const geometry::SE3& T_camera_lidar) {
    return calibration::draw_overlay(
        scene, config.camera, T_camera_lidar, config.calibration.lidar_edges);
  };
  write_picture(folder / "calibration_before.png", overlay(before));
  write_picture(folder / "calibration_after.png", overlay(result.T_camera_lidar));
  rig.T_lidar_camera = result.T_camera_lidar.inverse();
  // A refused result is kept as a proposal, under a name that no configuration reads.
  const auto file = folder / (result.accepted ? "rig.yaml" : "rig_refused.yaml");
  const auto problem = calibration_component::write_rig_file(
      file, calibration_component::rig_file_text(config.camera, sensors::to_config(rig)));
  if (!problem.empty()) throw CommandError(problem);
  fmt::print("{}\n", file.string());
}

int run(const CalibrateOptions& options) {
  CalibrateConfig config;
  try {
    config = read_config(options.parameters);
  } catch (const config::ConfigError& error) {
    fmt::print(stderr, "camvox: {}\n", error.what());
    return Exit::kBadUsage;
  }
  const auto T_camera_lidar = sensors::make_rig_calibration(config.rig).T_camera_lidar();
  const auto scene = read_scene(options.scene, config.camera);
  const auto begin = std::chrono::steady_clock::now();
  const auto result = calibrate_until_signal(scene, config, T_camera_lidar);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
  if (result.status == CalibrationStatus::kCancelled) return Exit::kInterrupted;
  if (result.status != CalibrationStatus::kDone) {
    throw CommandError("no calibration: " + result.reason);
  }
  const auto turn = T_camera_lidar.rotation().inverse() * result.T_camera_lidar.rotation();
  fmt::print("{} returns, {} edges, took {:.1f} s\n{}turned by {:.3f} deg, moved by {:.4f} m\n",
             scene.points_lidar.size(),
             result.lidar_edges,
             elapsed.count(),
             calibration::report_text(result),
             turn.angle_rad() * 180.0 / std::numbers::pi,
             (result.T_camera_lidar.translation() - T_camera_lidar.translation()).norm());
  write_results(options, config, scene, result);
  return result.accepted ? Exit::kDone : Exit::kFailed;
}

}  // namespace

void add_calibrate(CLI::App& app, Action& action) {
  auto options = std::make_shared<CalibrateOptions>();
  auto* command = app.add_subcommand(
      "calibrate", "Find lidar-camera extrinsics in a recording of a robot that stands still");
  command->add_option("bag", options->scene.bag, "The recording")->required();
  command
      ->add_option("--parameters", options->parameters, "rig.yaml: camera, and rig as first guess")
      ->required();
  command
      ->add_option("-o,--output",
                   options->output,
                   "Folder for rig.yaml and overlay pictures of before and after")
      ->required();
  command->add_option("--start", options->scene.start_s, "First second to use (default: 0)")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--duration", options->scene.duration_s, "Seconds of scans (default: 4)")
      ->check(CLI::PositiveNumber);
  command->add_option("--image-topic", options->scene.image_topic, "Default: the first one");
  command->add_option("--lidar-topic", options->scene.lidar_topic, "Default: the first one");
  command->footer(
      "A result that does not pass the gate is written as rig_refused.yaml, and the exit code is "
      "1.");
  command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace camvox::command
