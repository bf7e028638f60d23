#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/loop/consistency.hpp"
#include "camvox/loop/geometric_verification.hpp"
#include "camvox/loop/map_replica.hpp"
#include "camvox/loop/surface_registration.hpp"
#include "camvox/loop/surroundings.hpp"

namespace camvox::loop {

/// Tuning of the search for places that were passed in another direction. YAML keys are the field
/// names.
struct SurfacePlacesConfig {
  bool enabled = true;
  int every_keyframes = 3;      ///< Every so many keyframes one is looked at; takes 0.1 s.
  double min_turn_deg = 60.0;   ///< Looking less apart, images see the same.
  double max_distance_m = 4.0;  ///< Of the two, besides what the map may be wrong by.
  double max_search_m = 6.0;    ///< A map that may be farther off is searched only so far.
  double max_search_deg = 8.0;  ///< The same, rotation.
  double max_depth_m = 40.0;    ///< Features farther away are too coarse to show a surface.
  int max_views = 64;           ///< Keyframes that a place is put together from.
  double base_sigma_m = 0.1;    ///< Of a pose: the paths of both sides are bent themselves.
  double base_sigma_deg = 0.3;  ///< The same, rotation.
  double min_correction = 3.5;  ///< A map that is less far off, in sigma, is left as it is.
  SurroundingsConfig surroundings;
  RegistrationConfig registration;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("enabled", self.enabled);
    field("every_keyframes", self.every_keyframes, config::at_least(1));
    field("min_turn_deg", self.min_turn_deg, config::at_least(0.0), config::at_most(180.0));
    field("max_distance_m", self.max_distance_m, config::at_least(0.0));
    field("max_search_m", self.max_search_m, config::at_least(1.0), config::at_most(20.0));
    field("max_search_deg", self.max_search_deg, config::at_least(1.0), config::at_most(30.0));
    field("max_depth_m", self.max_depth_m, config::greater_than(0.0));
    field("max_views", self.max_views, config::at_least(1));
    field("base_sigma_m", self.base_sigma_m, config::at_least(0.0));
    field("base_sigma_deg", self.base_sigma_deg, config::at_least(0.0));
    field("min_correction", self.min_correction, config::at_least(0.0));
    field("surroundings", self.surroundings);
    field("registration", self.registration);
  }
};

/// A place that a keyframe may have come back to in another direction, where its image shows other
/// things than the old ones: what stands around both, to be compared on another thread.
struct SurfaceTask {
  struct Side {
    std::vector<std::shared_ptr<const features::FrameFeatures>> features;  ///< By view.
    std::vector<geometry::SE3> T_keyframe_camera;                          ///< By view.
    std::size_t centre = 0;  ///< The view of the keyframe itself.
  };
  KeyframeId match_id = 0;
  Side query;
  Side match;
  geometry::SE3 T_match_query;  ///< As the map has it.
  double search_m = 0.0;        ///< How far that may be off.
  double search_yaw_rad = 0.0;
};

/// The nearest place in the map that was passed in another direction; nothing when there is none
/// that far along the path, or when it is not the keyframe's turn. `loops`: ways that are short
/// because a loop was closed.
[[nodiscard]] std::optional<SurfaceTask> find_surface_place(const MapReplica& map,
                                                            KeyframeId query,
                                                            const MapReplica::Connections& loops,
                                                            const DriftConfig& drift,
                                                            const SurfacePlacesConfig& config);

/// Compares the two sides: surfaces that were measured at the features' depths, registered in the
/// level frames of both. About 0.1 s.
[[nodiscard]] Registration verify(const SurfaceTask& task,
                                  const optimization::PinholeCamera& camera,
                                  const SurfacePlacesConfig& config);

}  // namespace camvox::loop
