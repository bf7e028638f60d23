#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/features/feature.hpp"
#include "camvox/features/feature_grid.hpp"

namespace camvox::features {

/// Descriptor distances below which features are taken for the same: strict and permissive.
inline constexpr int kStrictDistance = 50;
inline constexpr int kPermissiveDistance = 100;

/// A feature (or landmark) `query` of one list seen again as `target` of another.
struct Match {
  std::uint32_t query = 0;
  std::uint32_t target = 0;
  int distance = 0;  ///< Of the descriptors, in bits.

  bool operator==(const Match&) const = default;
};

/// What makes a match. YAML keys are the field names.
struct MatchConfig {
  int max_distance = kPermissiveDistance;  ///< Bits in which descriptors may differ.
  double max_ratio = 0.8;                  ///< Nearest to second nearest distance; 1: no test.
  bool check_rotation = true;              ///< Drop matches that turn otherwise than most do.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("max_distance", self.max_distance, config::at_least(0), config::at_most(256));
    field("max_ratio", self.max_ratio, config::greater_than(0.0), config::at_most(1.0));
    field("check_rotation", self.check_rotation);
  }
};

/// Something that should be seen in a frame: a landmark, or a feature of another frame.
struct Expected {
  SearchArea area;         ///< Where, in the undistorted image.
  Descriptor descriptor;   ///< As what.
  float angle_rad = 0.0F;  ///< Its orientation where it was seen before (rotation check).
};

/// Finds each of `expected` in the frame. The ratio test compares with the second nearest of the
/// same octave only, since neighbouring octaves show the same corner. A feature is matched at most
/// once, to the nearest query. `taken[i] != 0` leaves feature i out; may be empty. Matches are
/// sorted by query.
[[nodiscard]] std::vector<Match> match_by_projection(std::span<const Expected> expected,
                                                     const FrameFeatures& frame,
                                                     const FeatureGrid& grid,
                                                     std::span<const std::uint8_t> taken,
                                                     const MatchConfig& config);

/// Finds each feature of `from` in `to` within `radius_px` (half the side of a square) of the
/// same undistorted place, in its own and the neighbouring octaves.
[[nodiscard]] std::vector<Match> match_by_neighbourhood(const FrameFeatures& from,
                                                        const FrameFeatures& to,
                                                        const FeatureGrid& grid_to,
                                                        float radius_px,
                                                        const MatchConfig& config);

/// A feature and the node of the vocabulary tree that it falls to.
struct WordEntry {
  std::uint32_t node = 0;
  std::uint32_t feature = 0;

  auto operator<=>(const WordEntry&) const = default;
};

/// Finds features of `from` in `to` among those of the same node. Both lists must be sorted.
[[nodiscard]] std::vector<Match> match_by_words(const FrameFeatures& from,
                                                std::span<const WordEntry> words_from,
                                                const FrameFeatures& to,
                                                std::span<const WordEntry> words_to,
                                                const MatchConfig& config);

/// Keeps the matches whose rotation (target minus query) falls into the fullest three of 30 bins;
/// the second and third count only with at least a tenth of the fullest (Mur-Artal & Tardos, T-RO
/// 2015).
void keep_consistent_rotations(std::span<const float> query_angles_rad,
                               std::span<const KeyPoint> targets,
                               std::vector<Match>& matches);

}  // namespace camvox::features
