// How well features are found again and matched, ours beside cv::ORB on the same images, same
// number of features, same matcher (mutually nearest, ratio 0.8).
//
// "warp": each image against itself turned, zoomed, tilted and with noise, so that the truth is
// known: share of features that are found again, share of matches that are right (both within
// 2.5 px times the larger scale), right matches per 100 features, the error of their places, and
// the largest error that the homography estimated from the matches has at the image's corners.
// "pair": each image against a later one of the recording: matches that agree with one fundamental
// matrix (RANSAC, 1.5 px).
#include <cstdio>

#include "bench_images.hpp"
#include "camvox/match_quality.hpp"

using namespace camvox::match_quality;

int main() {
  for (const auto& set : camvox::bench::image_sets(4, 30)) {
    for (const bool ours : {true, false}) {
      const Extract extract = ours ? our_extractor(set.features) : orb_extractor(set.features);
      Score warp, pair;
      for (std::size_t i = 0; i < set.images.size(); i += 3) {
        for (int index = 0; index < kWarps; ++index)
          score_warp(extract, set.images[i], index, warp);
      }
      const std::size_t gap = set.name[0] == 'R' ? 3 : 1;
      for (std::size_t i = 0; i + gap < set.images.size(); ++i) {
        score_pair(extract, set.images[i], set.images[i + gap], pair);
      }
      std::printf(
          "%-20s %-7s warp: found again %.2f  right %.3f  per 100 %4.1f  error %.2f px"
          "  homography %.2f (90 %%: %.2f) px   pair: right %.3f  per 100 %4.1f  error %.2f px\n",
          set.name.c_str(),
          ours ? "ours" : "cv::ORB",
          warp.found_again_share(),
          warp.right_share(),
          warp.right_per_100(),
          warp.error_px(),
          warp.quantile(0.5),
          warp.quantile(0.9),
          pair.right_share(),
          pair.right_per_100(),
          pair.error_px());
    }
  }
  return 0;
}
