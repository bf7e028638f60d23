#pragma once

#include <vector>

#include "camvox/simulation/mesh.hpp"

namespace camvox::simulation {

/// Indices into the list that make_palette() returns.
namespace palette {
enum : int {
  kAsphalt,
  kSidewalk,
  kKerb,
  kLawn,
  kRoadMarking,
  kBrickRed,
  kBrickBrown,
  kPlasterWhite,
  kPlasterYellow,
  kPlasterGrey,
  kConcrete,
  kFrameWhite,
  kFrameDark,
  kWindows,
  kPosters,
  kBark,
  kLeafDark,
  kLeafLight,
  kLeafYellow,
  kPole,
  kPlate,
  kRubber,
  kCarGlass,
  kCarWhite,
  kCarSilver,
  kCarRed,
  kCarBlue,
  kCarBlack,
  kSkin,
  kClothBlue,
  kClothRed,
  kClothGreen,
  kTrousers,
  kWood,
  kFloor,
  kCorridorWall,
  kCeiling,
  kLamp,
  kDoor,
  kRoof,
  kCount
};
inline constexpr float kWindowsTile_m = 8.0f;
inline constexpr float kPostersTile_m = 8.0f;
}  // namespace palette

/// The materials of all worlds.
[[nodiscard]] std::vector<Material> make_palette();

}  // namespace camvox::simulation
