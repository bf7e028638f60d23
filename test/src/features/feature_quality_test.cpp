#include <gmock/gmock.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "camvox/match_quality.hpp"

namespace camvox::features {
namespace {

using namespace match_quality;

struct Comparison {
  Score ours;
  Score orb;
};

/// Both on the same warped images.
Comparison compare(const std::vector<std::string>& files, int features) {
  Comparison comparison;
  const Extract ours = our_extractor(features);
  const Extract orb = orb_extractor(features);
  for (const std::string& file : files) {
    const auto path = std::filesystem::path(SHARED_DATA) / file;
    if (!std::filesystem::exists(path)) continue;
    const cv::Mat image = cv::imread(path.string(), cv::IMREAD_GRAYSCALE);
    for (int index = 0; index < kWarps; ++index) {
      score_warp(ours, image, index, comparison.ours);
      score_warp(orb, image, index, comparison.orb);
    }
  }
  return comparison;
}

/// Places between pixels and the spread over the image make the geometry from the matches better by
/// far; the number of right matches is about the same: a few per cent is the spread of single
/// images.
void expect_better(const Comparison& comparison) {
  const auto& [ours, orb] = comparison;
  EXPECT_LT(ours.quantile(0.5), 0.6 * orb.quantile(0.5));
  EXPECT_LT(ours.quantile(0.9), 0.6 * orb.quantile(0.9));
  EXPECT_GT(ours.right_per_100(), 0.93 * orb.right_per_100());
  EXPECT_GT(ours.right_share(), 0.97 * orb.right_share());
  EXPECT_LT(ours.error_px(), 0.8 * orb.error_px());
}

TEST(FeatureQuality, MatchesRedKitchenAsWellAsOrb) {
  const auto comparison = compare({"redkitchen/frame-000000.color.jpg",
                                   "redkitchen/frame-000150.color.jpg",
                                   "redkitchen/frame-000300.color.jpg",
                                   "redkitchen/frame-000450.color.jpg"},
                                  1000);
  if (comparison.ours.visible == 0) GTEST_SKIP() << "RedKitchen is not in " << SHARED_DATA;
  expect_better(comparison);
}

TEST(FeatureQuality, MatchesKittiAsWellAsOrb) {
  const std::string folder = "kitti_0013/2011_09_26_drive_0013_sync/image_02/data/";
  const auto comparison = compare({folder + "0000000020.jpg", folder + "0000000100.jpg"}, 2000);
  if (comparison.ours.visible == 0) GTEST_SKIP() << "KITTI is not in " << SHARED_DATA;
  expect_better(comparison);
}

}  // namespace
}  // namespace camvox::features
