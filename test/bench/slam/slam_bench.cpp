// Runs tracking and mapping over a recording on one thread and prints accuracy and CPU times,
// beside cv::ORB on the same images in the same run.
//   camvox import 7scenes DIR -o rk && slam_bench rk --features 1000 --out rk.tum
#include <time.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <map>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "camvox/mapping/mapper.hpp"
#include "camvox/test/founded_map.hpp"
#include "camvox/tracking/frame_builder.hpp"
#include "camvox/tracking/tracker.hpp"
#include "evaluation.hpp"
#include "recording.hpp"

namespace camvox::bench {
namespace {

using geometry::SE3;

struct Options {
  std::string bag;
  int features = 1500;
  std::size_t frames = 0;
  std::string out;
  tracking::TrackerConfig tracker;
  mapping::MappingConfig mapping;
  bool without_mapping = false;
  bool plain_depth = false;
  int depth_radius_px = tracking::FrameBuilderConfig().depth_radius_px;
  bool verbose = false;
};

/// CPU time of this thread.
double cpu_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// Adds the CPU time since it was made, or since the last call, to lists.
class Stopwatch {
 public:
  double lap(std::vector<double>& times_ms) {
    const double now_ms = cpu_ms();
    const double lap_ms = now_ms - start_ms_;
    times_ms.push_back(lap_ms);
    start_ms_ = now_ms;
    return lap_ms;
  }
  void restart() { start_ms_ = cpu_ms(); }

 private:
  double start_ms_ = cpu_ms();
};

struct Times {
  std::vector<double> yardstick_ms, build_ms, track_ms, update_ms, total_ms, mapping_ms, extract_ms,
      other_ms;
};

void print_row(const char* name, const std::vector<double>& times_ms, double yardstick_ms) {
  const double median_ms = quantile(times_ms, 0.5);
  const double p90_ms = quantile(times_ms, 0.9);
  const double p99_ms = quantile(times_ms, 0.99);
  std::printf("  %-26s %7.2f %7.2f %7.2f   %5.2fx %5.2fx\n",
              name,
              median_ms,
              p90_ms,
              p99_ms,
              median_ms / yardstick_ms,
              p99_ms / yardstick_ms);
}

void print(const Times& times) {
  const double yardstick_ms = quantile(times.yardstick_ms, 0.5);
  std::printf(
      "CPU ms                        median     p90     p99   median and p99 / yardstick\n");
  print_row("cv::ORB (yardstick)", times.yardstick_ms, yardstick_ms);
  print_row("features and depth", times.build_ms, yardstick_ms);
  print_row("pose and matches", times.track_ms, yardstick_ms);
  print_row("take in the local map", times.update_ms, yardstick_ms);
  print_row("tracking, all", times.total_ms, yardstick_ms);
  print_row("mapping of a keyframe", times.mapping_ms, yardstick_ms);
  print_row("cut out the local map", times.extract_ms, yardstick_ms);
}

void print(std::size_t number, const tracking::FrameResult& result) {
  const auto& s = result.statistics;
  std::printf(
      "%4zu state %d features %d depth %d matches %d inliers %d depth %d banned %d "
      "chi2 %.2f reference %llu %s\n",
      number,
      static_cast<int>(result.state),
      s.features,
      s.features_with_depth,
      s.matches,
      s.inliers,
      s.inliers_with_depth,
      s.banned_landmarks,
      s.chi2_per_row,
      static_cast<unsigned long long>(result.reference_keyframe_id),
      result.keyframe ? "keyframe" : "");
}

class Run {
 public:
  Run(const Options& options, const Recording& recording)
      : options_(options),
        recording_(recording),
        builder_(builder_config(options), recording.intrinsics),
        tracker_(options.tracker, builder_.tracking_camera(), recording.T_body_camera),
        founded_(builder_.tracking_camera()),
        mapper_(options.mapping, builder_.tracking_camera()),
        depth_source_(recording, options.plain_depth),
        orb_(cv::ORB::create(options.features)) {}

  void process(std::size_t number);
  void report() const;

 private:
  static tracking::FrameBuilderConfig builder_config(const Options& options) {
    tracking::FrameBuilderConfig config;
    config.extractor.features = options.features;
    config.depth_radius_px = options.depth_radius_px;
    return config;
  }
  void insert(const tracking::Keyframe& keyframe, tracking::KeyframeId reference);
  [[nodiscard]] std::map<tracking::KeyframeId, SE3> keyframe_poses() const;
  [[nodiscard]] std::vector<SE3> trajectory_body() const;

  const Options& options_;
  const Recording& recording_;
  tracking::FrameBuilder builder_;
  tracking::Tracker tracker_;
  test::FoundedMap founded_;
  mapping::Mapper mapper_;
  DepthSource depth_source_;
  cv::Ptr<cv::ORB> orb_;
  geometry::Vector6d twist_camera_ = geometry::Vector6d::Zero();
  Times times_;
  std::vector<tracking::FrameResult> results_;
};

void Run::process(std::size_t number) {
  const auto& recorded = recording_.frames[number];
  const cv::Mat image = cv::imdecode(recorded.image_file, cv::IMREAD_GRAYSCALE);
  const auto depth = depth_source_.depth_of(recorded, twist_camera_);

  Stopwatch watch;
  std::vector<cv::KeyPoint> key_points;
  cv::Mat descriptors;
  orb_->detectAndCompute(image, {}, key_points, descriptors);
  watch.lap(times_.yardstick_ms);

  tracking::Frame frame;
  frame.frame_id = number + 1;
  frame.stamp_ns = recorded.stamp_ns;
  frame.features = builder_.build(
      {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)}, depth);
  double total_ms = watch.lap(times_.build_ms);
  auto result = tracker_.track(std::move(frame));
  total_ms += watch.lap(times_.track_ms);
  if (result.keyframe) insert(*result.keyframe, result.reference_keyframe_id);
  watch.lap(result.keyframe ? times_.mapping_ms : times_.other_ms);
  auto map = options_.without_mapping ? founded_.local_map(number + 1)
                                      : mapper_.local_map(number + 1, result.reference_keyframe_id);
  watch.lap(times_.extract_ms);
  tracker_.update_map(std::move(map));
  total_ms += watch.lap(times_.update_ms);
  times_.total_ms.push_back(total_ms);

  twist_camera_ << result.angular_velocity_camera, result.velocity_camera;
  if (options_.verbose) print(number, result);
  result.keyframe.reset();
  results_.push_back(std::move(result));
}

void Run::insert(const tracking::Keyframe& keyframe, tracking::KeyframeId reference) {
  if (options_.without_mapping) return founded_.insert(keyframe);
  mapper_.set_reference(reference);
  const auto report = mapper_.process(keyframe);
  if (!report.inserted) throw std::runtime_error("keyframe refused: " + report.problem);
}

/// Where mapping has them in the end.
std::map<tracking::KeyframeId, SE3> Run::keyframe_poses() const {
  if (options_.without_mapping) return founded_.poses();
  std::map<tracking::KeyframeId, SE3> poses;
  for (const auto& keyframe : mapper_.all_changes().keyframes) {
    poses[keyframe.id] = keyframe.T_map_camera;
  }
  return poses;
}

std::vector<SE3> Run::trajectory_body() const {
  const auto poses = keyframe_poses();
  std::vector<SE3> trajectory;
  for (const auto& result : results_) {
    const auto keyframe = poses.find(result.reference_keyframe_id);
    const SE3 T_map_camera =
        keyframe == poses.end() ? result.T_map_camera : keyframe->second * result.T_keyframe_camera;
    trajectory.push_back(T_map_camera * recording_.T_body_camera.inverse());
  }
  return trajectory;
}

void Run::report() const {
  const auto trajectory = trajectory_body();
  std::vector<SE3> estimate;
  std::vector<SE3> truth;
  std::ofstream file(options_.out);
  std::size_t lost = 0;
  for (std::size_t k = 0; k < results_.size(); ++k) {
    lost += results_[k].has_pose() ? 0 : 1;
    if (!results_[k].has_pose()) continue;
    const auto& t = trajectory[k].translation();
    const auto& q = trajectory[k].rotation().quaternion();
    char line[256];
    std::snprintf(line,
                  sizeof(line),
                  "%.9f %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n",
                  1e-9 * static_cast<double>(results_[k].stamp_ns),
                  t.x(),
                  t.y(),
                  t.z(),
                  q.x(),
                  q.y(),
                  q.z(),
                  q.w());
    if (!options_.out.empty()) file << line;
    if (!recording_.frames[k].T_truth_body) continue;
    estimate.push_back(trajectory[k]);
    truth.push_back(*recording_.frames[k].T_truth_body);
  }
  const auto error = absolute_error(estimate, truth);
  std::printf("frames %zu, without pose %zu, keyframes %zu\n",
              results_.size(),
              lost,
              keyframe_poses().size());
  std::printf("ATE rmse %.4f m, max %.4f m; scale error %+.3f %%, rmse with scale %.4f m\n",
              error.rmse_m,
              error.max_m,
              100.0 * (1.0 / error.scale - 1.0),
              error.rmse_scaled_m);
  print(times_);
}

}  // namespace
}  // namespace camvox::bench

int main(int argc, char** argv) {
  camvox::bench::Options options;
  CLI::App app("Tracking and mapping over a recording");
  app.add_option("bag", options.bag)->required();
  app.add_option("--features", options.features);
  app.add_option("--frames", options.frames, "only the first so many");
  app.add_option("--out", options.out, "trajectory of the body, TUM");
  app.add_option("--depth-model", options.tracker.depth_model, "metric or virtual_stereo");
  app.add_option("--sigma-px", options.tracker.sigma_px);
  app.add_flag("--without-mapping", options.without_mapping, "landmarks stay as founded");
  app.add_flag("--plain-depth", options.plain_depth, "lidar returns without fill and occlusion");
  app.add_option("--depth-radius-px", options.depth_radius_px);
  app.add_flag("--verbose", options.verbose);
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);
  const auto recording = camvox::bench::read_recording(options.bag);
  camvox::bench::Run run(options, recording);
  const std::size_t count = recording.frames.size();
  const std::size_t last = options.frames > 0 ? std::min(options.frames, count) : count;
  for (std::size_t number = 0; number < last; ++number) run.process(number);
  run.report();
  return 0;
}
