#pragma once

#include <string>

#include "camvox/config/parameters.hpp"
#include "camvox/optimization/bundle_adjustment.hpp"

namespace camvox::mapping {

/// Tuning of Mapper. YAML keys are the field names. Defaults are those of ORB-SLAM2's RGB-D mode
/// (Mur-Artal & Tardos, T-RO 2017) unless a comment says otherwise.
struct MappingConfig {
  std::string depth_model = "metric";  ///< Or virtual_stereo: the paper's, for comparison.
  double virtual_baseline_m = 0.05;    ///< Of virtual_stereo.
  double sigma_px = 1.0;               ///< Of a feature of octave 0; grows with the octave's scale.
  double max_depth_sigma_ratio = 0.1;  ///< Depth less certain than this share is not used.
  int local_map_keyframes = 80;        ///< What tracking gets at most.
  int local_map_landmarks = 8000;      ///< The same; the nearest keyframes' first.
  int window_keyframes = 12;           ///< Poses that local bundle adjustment moves.
  int window_fixed_keyframes = 12;     ///< Poses that hold it in place.
  int window_landmarks = 2500;         ///< Points in it; those seen most often first.
  int triangulation_neighbours = 6;    ///< Keyframes that new landmarks are searched in.
  int fusion_neighbours = 10;          ///< Keyframes that duplicates are searched in,
  int fusion_second_neighbours = 5;    ///< and of each of those so many more, 20 in all at most.
  double fusion_radius_px = 3.0;       ///< Around the projection, times the octave's scale.
  double loop_fusion_radius_px = 6.0;  ///< The same across a loop that was just closed.
  double min_found_ratio = 0.25;       ///< Young landmarks found more seldom are dropped.
  int min_observations = 3;            ///< Of young landmarks; one with depth counts as two.
  double max_redundancy = 0.9;         ///< Share of its points seen elsewhere, above which a
                                       ///< keyframe is dropped.
  int redundancy_observers = 3;        ///< How many others must see a point.
  int place_keyframes = 10;            ///< Looking the same way from one place, so many at most.
  double min_parallax_deg = 1.0;       ///< Between the rays of a triangulated landmark.
  int full_bundle_iterations = 10;     ///< Of the bundle adjustment after a loop; 0: none.
  optimization::BundleAdjustmentConfig bundle;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("depth_model", self.depth_model, config::one_of({"metric", "virtual_stereo"}));
    field("virtual_baseline_m", self.virtual_baseline_m, config::greater_than(0.0));
    field("sigma_px", self.sigma_px, config::greater_than(0.0));
    field("max_depth_sigma_ratio", self.max_depth_sigma_ratio, config::greater_than(0.0));
    field(
        "local_map_keyframes", self.local_map_keyframes, config::at_least(1), config::at_most(255));
    field("local_map_landmarks",
          self.local_map_landmarks,
          config::at_least(100),
          config::at_most(20000));
    field("window_keyframes", self.window_keyframes, config::at_least(1));
    field("window_fixed_keyframes", self.window_fixed_keyframes, config::at_least(1));
    field("window_landmarks", self.window_landmarks, config::at_least(100));
    field("triangulation_neighbours", self.triangulation_neighbours, config::at_least(0));
    field("fusion_neighbours", self.fusion_neighbours, config::at_least(0));
    field("fusion_second_neighbours", self.fusion_second_neighbours, config::at_least(0));
    field("fusion_radius_px", self.fusion_radius_px, config::greater_than(0.0));
    field("loop_fusion_radius_px", self.loop_fusion_radius_px, config::greater_than(0.0));
    field("min_found_ratio", self.min_found_ratio, config::at_least(0.0), config::at_most(1.0));
    field("min_observations", self.min_observations, config::at_least(1));
    field("max_redundancy", self.max_redundancy, config::at_least(0.5), config::at_most(1.0));
    field("redundancy_observers", self.redundancy_observers, config::at_least(1));
    field("place_keyframes", self.place_keyframes, config::at_least(2));
    field("min_parallax_deg", self.min_parallax_deg, config::greater_than(0.0));
    field("full_bundle_iterations", self.full_bundle_iterations, config::at_least(0));
    field("bundle", self.bundle);
  }
};

}  // namespace camvox::mapping
