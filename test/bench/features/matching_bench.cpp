// Time of what follows extraction in a frame: undistortion, grid, and matching each feature of the
// frame before within 15 px. CPU time of the thread, median per frame.
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "bench_images.hpp"
#include "camvox/features/feature_extractor.hpp"
#include "camvox/features/feature_grid.hpp"
#include "camvox/features/match.hpp"
#include "camvox/features/undistorter.hpp"

namespace {

using namespace camvox::features;

double thread_time_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

void measure(const camvox::bench::ImageSet& set) {
  camvox::sensors::CameraIntrinsics intrinsics;
  intrinsics.width_px = set.images[0].cols;
  intrinsics.height_px = set.images[0].rows;
  intrinsics.cx_px = intrinsics.width_px / 2.0;
  intrinsics.cy_px = intrinsics.height_px / 2.0;
  const Undistorter undistorter{camvox::sensors::CameraModel(intrinsics)};
  ExtractorConfig config;
  config.features = set.features;
  FeatureExtractor extractor(config);
  FrameFeatures last;
  std::vector<double> undistort_us, grid_us, match_us, counts;
  for (int round = 0; round < 4; ++round) {
    for (const cv::Mat& image : set.images) {
      FrameFeatures features = extractor.extract(
          {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)});
      const double start_us = thread_time_us();
      undistorter.undistort(features);
      const double undistorted_us = thread_time_us();
      const FeatureGrid grid(features);
      const double sorted_us = thread_time_us();
      const auto matches = match_by_neighbourhood(last, features, grid, 15.0F, {});
      match_us.push_back(thread_time_us() - sorted_us);
      undistort_us.push_back(undistorted_us - start_us);
      grid_us.push_back(sorted_us - undistorted_us);
      counts.push_back(static_cast<double>(matches.size()));
      last = std::move(features);
    }
  }
  std::printf("%-20s undistort %4.0f us  grid %4.0f us  match %4.0f us  (%.0f matches)\n",
              set.name.c_str(),
              median(undistort_us),
              median(grid_us),
              median(match_us),
              median(counts));
}

}  // namespace

int main() {
  for (const auto& set : camvox::bench::image_sets(1, 30)) measure(set);
  return 0;
}
