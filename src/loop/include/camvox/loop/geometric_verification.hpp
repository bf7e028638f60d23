#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/features/feature.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/optimization/point_observation.hpp"

namespace camvox::loop {

/// Tuning of verify(). YAML keys are the field names.
struct VerificationConfig {
  int max_distance_bits = 64;             ///< Of descriptors matched without a pose.
  double max_ratio = 0.85;                ///< Of the nearest to the second nearest distance.
  int matched_features = 1000;            ///< Strongest ones matched without a pose.
  int min_matches = 12;                   ///< Fewer matches or RANSAC inliers: no attempt.
  int ransac_iterations = 400;            ///< At most.
  std::int64_t seed = 1;                  ///< Of the samples.
  double pixel_sigma_px = 1.0;            ///< Of a feature of octave 0.
  double octave_scale = 1.2;              ///< Of the image pyramid.
  double ransac_error_px = 5.0;           ///< Largest error of an inlier of octave 0.
  double search_radius_px = 8.0;          ///< Of the matching with a pose.
  int guided_distance_bits = 72;          ///< Of descriptors matched with a pose.
  int guided_rounds = 5;                  ///< Of matching with a pose and refinement, at most.
  int min_inliers = 40;                   ///< After refinement.
  int min_cells = 6;                      ///< Of 8 x 4 image cells, those with an inlier.
  double depth_tolerance = 0.06;          ///< Relative difference at which depths still agree.
  double min_depth_agreement = 0.6;       ///< Part of the compared depths that must agree.
  double max_rotation_sigma_deg = 0.5;    ///< A pose less certain than this is none.
  double max_translation_sigma_m = 0.25;  ///< The same.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    const auto bits = config::at_most(256);
    field("max_distance_bits", self.max_distance_bits, config::at_least(0), bits);
    field("max_ratio", self.max_ratio, config::greater_than(0.0), config::at_most(1.0));
    field("matched_features", self.matched_features, config::at_least(10), config::at_most(65536));
    field("min_matches", self.min_matches, config::at_least(4));
    field("ransac_iterations", self.ransac_iterations, config::at_least(1));
    field("seed", self.seed, config::at_least(0));
    field("pixel_sigma_px", self.pixel_sigma_px, config::greater_than(0.0));
    field("octave_scale", self.octave_scale, config::greater_than(1.0));
    field("ransac_error_px", self.ransac_error_px, config::greater_than(0.0));
    field("search_radius_px", self.search_radius_px, config::greater_than(0.0));
    field("guided_distance_bits", self.guided_distance_bits, config::at_least(0), bits);
    field("guided_rounds", self.guided_rounds, config::at_least(1), config::at_most(20));
    field("min_inliers", self.min_inliers, config::at_least(10));
    field("min_cells", self.min_cells, config::at_least(1), config::at_most(32));
    field("depth_tolerance", self.depth_tolerance, config::greater_than(0.0));
    field("min_depth_agreement",
          self.min_depth_agreement,
          config::at_least(0.0),
          config::at_most(1.0));
    field("max_rotation_sigma_deg", self.max_rotation_sigma_deg, config::greater_than(0.0));
    field("max_translation_sigma_m", self.max_translation_sigma_m, config::greater_than(0.0));
  }
};

/// What one camera saw of a place.
struct PlaceView {
  const features::FrameFeatures* features = nullptr;
  geometry::SE3 T_place_camera;
};

/// A place of the map: the keyframe that was found, which gives the place its frame (identity),
/// then its neighbours.
using Place = std::vector<PlaceView>;

/// The layers in the order in which they are passed.
enum class VerificationStatus : std::uint8_t {
  kOk,
  kTooFewMatches,   ///< The images do not look alike.
  kNoRigidMotion,   ///< No rigid motion explains the matches.
  kTooFewInliers,   ///< It explains too few after the search around it, or only in one spot.
  kUncertain,       ///< The pose is not determined well enough.
  kDepthDisagrees,  ///< The surfaces that the two saw are not the same.
};
[[nodiscard]] std::string_view to_string(VerificationStatus status);

struct Verification {
  VerificationStatus status = VerificationStatus::kTooFewMatches;
  geometry::SE3 T_place_query;
  geometry::Matrix6d covariance_query = geometry::Matrix6d::Zero();  ///< Of T_place_query * exp(xi)
  int matches = 0;                                                   ///< By appearance alone.
  int ransac_inliers = 0;
  int inliers = 0;  ///< After refinement.
  int cells = 0;    ///< Image cells with an inlier.
  int depths_compared = 0;
  double depth_agreement = 0.0;  ///< Part of them that agrees.
};

/// Is `query` an image of `place`, and from where? In layers: descriptor matches with the first
/// view; RANSAC over rigid motions of three pairs of points with depth (Horn, 1987), judged in
/// pixels and depth; search for the features of all views around the pose and refinement, again
/// until the pose stays; then the surfaces: depths measured by the query near a projected point
/// must be those predicted. Deterministic. Work: about 5 ms for 1500 features on one core.
[[nodiscard]] Verification verify(const features::FrameFeatures& query,
                                  const Place& place,
                                  const optimization::PinholeCamera& camera,
                                  const VerificationConfig& config);

}  // namespace camvox::loop
