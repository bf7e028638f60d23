#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "camvox/features/feature_extractor.hpp"

/// How well features are found again and matched, ours beside cv::ORB's, with the same matcher
/// (mutually nearest, ratio 0.8).
namespace camvox::match_quality {

struct Features {
  std::vector<cv::Point2f> places_px;
  std::vector<float> scales;
  cv::Mat descriptors;
};

using Extract = std::function<Features(const cv::Mat&)>;

inline Extract our_extractor(int count) {
  camvox::features::ExtractorConfig config;
  config.features = count;
  auto extractor = std::make_shared<camvox::features::FeatureExtractor>(config);
  return [extractor](const cv::Mat& image) {
    const auto found = extractor->extract(
        {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)});
    Features features;
    features.descriptors.create(static_cast<int>(found.size()), 32, CV_8U);
    for (std::size_t i = 0; i < found.size(); ++i) {
      features.places_px.emplace_back(found.key_points[i].u_px, found.key_points[i].v_px);
      features.scales.push_back(static_cast<float>(extractor->scale(found.key_points[i].octave)));
      std::copy_n(
          found.descriptors[i].bytes.data(), 32, features.descriptors.ptr(static_cast<int>(i)));
    }
    return features;
  };
}

inline Extract orb_extractor(int count) {
  return [orb = cv::ORB::create(count)](const cv::Mat& image) {
    std::vector<cv::KeyPoint> key_points;
    Features features;
    orb->detectAndCompute(image, cv::noArray(), key_points, features.descriptors);
    for (const auto& key_point : key_points) {
      features.places_px.push_back(key_point.pt);
      features.scales.push_back(std::pow(1.2F, static_cast<float>(key_point.octave)));
    }
    return features;
  };
}

inline std::vector<cv::DMatch> match(const Features& a, const Features& b) {
  if (a.descriptors.rows < 2 || b.descriptors.rows < 2) return {};
  std::vector<std::vector<cv::DMatch>> forward;
  std::vector<cv::DMatch> backward, matches;
  const cv::BFMatcher matcher(cv::NORM_HAMMING);
  matcher.knnMatch(a.descriptors, b.descriptors, forward, 2);
  matcher.match(b.descriptors, a.descriptors, backward);
  for (const auto& two : forward) {
    const bool mutual =
        backward[static_cast<std::size_t>(two[0].trainIdx)].trainIdx == two[0].queryIdx;
    if (mutual && two[0].distance < 0.8F * two[1].distance) matches.push_back(two[0]);
  }
  return matches;
}

/// Sums over many image pairs.
struct Score {
  std::vector<double> corner_errors_px;
  double visible = 0, found_again = 0, matches = 0, right = 0, error_px2 = 0;

  [[nodiscard]] double quantile(double share) const {
    auto sorted = corner_errors_px;
    std::sort(sorted.begin(), sorted.end());
    return sorted.empty()
               ? 0.0
               : sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  }
  [[nodiscard]] double found_again_share() const { return found_again / std::max(1.0, visible); }
  [[nodiscard]] double right_share() const { return right / std::max(1.0, matches); }
  [[nodiscard]] double right_per_100() const { return 100.0 * right / std::max(1.0, visible); }
  [[nodiscard]] double error_px() const { return std::sqrt(error_px2 / std::max(1.0, right)); }
};

inline constexpr int kWarps = 8;

inline cv::Mat warp_of(const cv::Size& size, int index) {
  const double degrees[] = {5, -15, 40, 0, 0, 3, 90, 10};
  const double zooms[] = {1.0, 1.1, 0.9, 0.8, 1.3, 1.0, 1.0, 0.7};
  const double tilts[] = {0, 1e-4, -1e-4, 0, 0, 3e-4, 0, 1e-4};
  const double angle_rad = degrees[index] * CV_PI / 180.0;
  const double c = zooms[index] * std::cos(angle_rad), s = zooms[index] * std::sin(angle_rad);
  const cv::Matx33d to_centre(1, 0, -size.width / 2.0, 0, 1, -size.height / 2.0, 0, 0, 1);
  const cv::Matx33d turn(c, -s, 3.37, s, c, -2.61, tilts[index], tilts[index] / 2, 1);
  return cv::Mat(to_centre.inv() * turn * to_centre);
}

inline cv::Mat warped(const cv::Mat& image, const cv::Mat& H, int seed) {
  cv::Mat result, noise(image.size(), CV_16S);
  cv::warpPerspective(image, result, H, image.size(), cv::INTER_AREA);
  cv::theRNG().state = static_cast<std::uint64_t>(seed) + 1;
  cv::randn(noise, 0, 4);
  cv::add(result, noise, result, cv::noArray(), CV_8U);
  return result;
}

/// Of the homography that the matches give: the largest error at the image's corners.
inline double corner_error_px(const std::vector<cv::Point2f>& from,
                              const std::vector<cv::Point2f>& to,
                              const cv::Mat& H,
                              const cv::Size& size) {
  if (from.size() < 8) return 100.0;
  cv::theRNG().state = 7;
  const cv::Mat estimate = cv::findHomography(from, to, cv::RANSAC, 3.0);
  if (estimate.empty()) return 100.0;
  const auto w = static_cast<float>(size.width), h = static_cast<float>(size.height);
  const std::vector<cv::Point2f> corners = {{0, 0}, {w, 0}, {0, h}, {w, h}};
  std::vector<cv::Point2f> truth_px, found_px;
  cv::perspectiveTransform(corners, truth_px, H);
  cv::perspectiveTransform(corners, found_px, estimate);
  double worst_px = 0.0;
  for (std::size_t i = 0; i < 4; ++i)
    worst_px = std::max(worst_px, cv::norm(truth_px[i] - found_px[i]));
  return worst_px;
}

inline void score_warp(const Extract& extract, const cv::Mat& image, int index, Score& score) {
  const cv::Mat H = warp_of(image.size(), index);
  const Features a = extract(image);
  const Features b = extract(warped(image, H, index));
  std::vector<cv::Point2f> truth_px;
  cv::perspectiveTransform(a.places_px, truth_px, H);
  const auto near = [&](std::size_t i, std::size_t j) {
    const double reach_px = 2.5 * std::max(a.scales[i], b.scales[j]);
    return cv::norm(truth_px[i] - b.places_px[j]) < reach_px;
  };
  const cv::Rect2f inner(
      25, 25, static_cast<float>(image.cols - 50), static_cast<float>(image.rows - 50));
  for (std::size_t i = 0; i < truth_px.size(); ++i) {
    if (!inner.contains(truth_px[i])) continue;
    score.visible += 1;
    for (std::size_t j = 0; j < b.places_px.size(); ++j) {
      const float ratio = a.scales[i] / b.scales[j];
      if (!near(i, j) || ratio > 1.5F || ratio < 0.667F) continue;
      score.found_again += 1;
      break;
    }
  }
  std::vector<cv::Point2f> from, to;
  for (const auto& m : match(a, b)) {
    from.push_back(a.places_px[static_cast<std::size_t>(m.queryIdx)]);
    to.push_back(b.places_px[static_cast<std::size_t>(m.trainIdx)]);
    score.matches += 1;
    const auto i = static_cast<std::size_t>(m.queryIdx), j = static_cast<std::size_t>(m.trainIdx);
    if (!near(i, j)) continue;
    score.right += 1;
    score.error_px2 += std::pow(cv::norm(truth_px[i] - b.places_px[j]), 2);
  }
  score.corner_errors_px.push_back(corner_error_px(from, to, H, image.size()));
}

inline void score_pair(const Extract& extract,
                       const cv::Mat& first,
                       const cv::Mat& second,
                       Score& score) {
  const Features a = extract(first), b = extract(second);
  std::vector<cv::Point2f> from, to;
  for (const auto& m : match(a, b)) {
    from.push_back(a.places_px[static_cast<std::size_t>(m.queryIdx)]);
    to.push_back(b.places_px[static_cast<std::size_t>(m.trainIdx)]);
  }
  score.visible += static_cast<double>(a.places_px.size());
  score.matches += static_cast<double>(from.size());
  if (from.size() < 20) return;
  std::vector<std::uint8_t> inliers;
  cv::theRNG().state = 7;
  const cv::Mat F = cv::findFundamentalMat(from, to, cv::FM_RANSAC, 1.5, 0.999, 2000, inliers);
  if (F.rows != 3) return;
  for (std::size_t i = 0; i < inliers.size(); ++i) {
    if (inliers[i] == 0) continue;
    score.right += 1;
    const cv::Matx33d f(F);
    const cv::Vec3d line = f * cv::Vec3d(from[i].x, from[i].y, 1);
    const double distance = line.dot(cv::Vec3d(to[i].x, to[i].y, 1)) / std::hypot(line[0], line[1]);
    score.error_px2 += distance * distance;
  }
}

}  // namespace camvox::match_quality
