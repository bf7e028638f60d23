// Time of feature extraction, and as a ratio to cv::ORB's detectAndCompute on the same images, same
// number of features, one thread, taken in turns. CPU time of the thread.
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include "bench_images.hpp"
#include "camvox/features/feature_extractor.hpp"

namespace {

using camvox::features::FeatureExtractor;
using camvox::features::FrameFeatures;

double thread_time_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

template <typename Function>
double measure_ms(Function&& function) {
  const double start_ms = thread_time_ms();
  function();
  return thread_time_ms() - start_ms;
}

struct Quartiles {
  double low, median, high;
};

Quartiles quartiles(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return {values[n / 4], values[n / 2], values[3 * n / 4]};
}

void measure(const camvox::bench::ImageSet& set, int rounds) {
  camvox::features::ExtractorConfig config;
  config.features = set.features;
  FeatureExtractor extractor(config);
  const auto orb = cv::ORB::create(set.features);
  FrameFeatures features;
  std::vector<cv::KeyPoint> key_points;
  cv::Mat descriptors;
  std::vector<double> ours_ms, orb_ms, ratios;
  std::size_t our_count = 0, orb_count = 0;
  for (int round = 0; round < rounds; ++round) {
    for (const cv::Mat& image : set.images) {
      orb_ms.push_back(measure_ms(
          [&] { orb->detectAndCompute(image, cv::noArray(), key_points, descriptors); }));
      ours_ms.push_back(measure_ms([&] {
        extractor.extract(
            {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)},
            features);
      }));
      ratios.push_back(ours_ms.back() / orb_ms.back());
      our_count += features.size();
      orb_count += key_points.size();
    }
  }
  const auto ours = quartiles(ours_ms), orbs = quartiles(orb_ms), ratio = quartiles(ratios);
  std::printf("%-20s %6.2f [%.2f %.2f]   %6.2f [%.2f %.2f]   %.3f [%.3f %.3f]   %zu  %zu\n",
              set.name.c_str(),
              ours.median,
              ours.low,
              ours.high,
              orbs.median,
              orbs.low,
              orbs.high,
              ratio.median,
              ratio.low,
              ratio.high,
              our_count / ours_ms.size(),
              orb_count / ours_ms.size());
}

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc > 1 ? std::atoi(argv[1]) : 5;
  cv::setNumThreads(1);
  std::printf(
      "%-20s %-22s %-24s %-22s features\n", "median [quartiles]", "ours ms", "cv::ORB ms", "ratio");
  for (const auto& set : camvox::bench::image_sets(10, 15)) measure(set, rounds);
  return 0;
}
