#include "palette.hpp"

namespace camvox::simulation {
namespace {

using K = TextureKind;

Material surface(K texture, float tile_m, float r, float g, float b, float reflectivity) {
  Material material;
  material.texture = texture;
  material.tile_m = tile_m;
  material.tint = {r, g, b};
  material.reflectivity = reflectivity;
  return material;
}

Material smooth(K texture, float tile_m, float r, float g, float b, float reflectivity) {
  Material material = surface(texture, tile_m, r, g, b, reflectivity);
  material.blotches = 0.1f;
  return material;
}

}  // namespace

std::vector<Material> make_palette() {
  namespace p = palette;
  std::vector<Material> m(p::kCount);
  m[p::kAsphalt] = surface(K::kAsphalt, 4.0f, 1.0f, 1.0f, 1.0f, 0.17f);
  m[p::kSidewalk] = surface(K::kPaving, 4.0f, 1.0f, 1.0f, 1.0f, 0.35f);
  m[p::kKerb] = surface(K::kConcrete, 3.0f, 1.1f, 1.1f, 1.1f, 0.40f);
  m[p::kLawn] = surface(K::kGrass, 3.0f, 1.0f, 1.0f, 1.0f, 0.45f);
  m[p::kRoadMarking] = surface(K::kAsphalt, 3.0f, 3.4f, 3.4f, 3.3f, 0.65f);
  m[p::kBrickRed] = surface(K::kBrick, 2.0f, 1.0f, 1.0f, 1.0f, 0.35f);
  m[p::kBrickBrown] = surface(K::kBrick, 2.0f, 0.85f, 1.05f, 1.05f, 0.30f);
  m[p::kPlasterWhite] = surface(K::kPlaster, 5.0f, 1.0f, 1.0f, 1.0f, 0.60f);
  m[p::kPlasterYellow] = surface(K::kPlaster, 5.0f, 1.0f, 0.86f, 0.60f, 0.55f);
  m[p::kPlasterGrey] = surface(K::kPlaster, 5.0f, 0.66f, 0.70f, 0.74f, 0.42f);
  m[p::kConcrete] = surface(K::kConcrete, 5.0f, 1.0f, 1.0f, 1.0f, 0.40f);
  m[p::kFrameWhite] = smooth(K::kPaint, 2.0f, 1.0f, 1.0f, 0.98f, 0.60f);
  m[p::kFrameDark] = smooth(K::kPaint, 2.0f, 0.22f, 0.24f, 0.26f, 0.15f);
  m[p::kWindows] = smooth(K::kWindows, p::kWindowsTile_m, 1.0f, 1.0f, 1.0f, 0.08f);
  m[p::kPosters] = smooth(K::kPosters, p::kPostersTile_m, 1.0f, 1.0f, 1.0f, 0.50f);
  m[p::kBark] = surface(K::kBark, 1.5f, 1.0f, 1.0f, 1.0f, 0.35f);
  m[p::kLeafDark] = surface(K::kFoliage, 1.5f, 0.7f, 0.75f, 0.7f, 0.50f);
  m[p::kLeafLight] = surface(K::kFoliage, 1.5f, 1.3f, 1.25f, 1.0f, 0.55f);
  m[p::kLeafYellow] = surface(K::kFoliage, 1.5f, 1.9f, 1.3f, 0.9f, 0.55f);
  m[p::kPole] = smooth(K::kPaint, 1.0f, 0.38f, 0.40f, 0.40f, 0.40f);
  m[p::kPlate] = smooth(K::kPosters, p::kPostersTile_m, 1.0f, 1.0f, 1.0f, 0.90f);
  m[p::kPlate].retroreflective = true;
  m[p::kRubber] = smooth(K::kPaint, 1.0f, 0.08f, 0.08f, 0.08f, 0.06f);
  m[p::kCarGlass] = smooth(K::kPaint, 3.0f, 0.12f, 0.14f, 0.16f, 0.05f);
  m[p::kCarWhite] = smooth(K::kPaint, 3.0f, 1.05f, 1.05f, 1.05f, 0.70f);
  m[p::kCarSilver] = smooth(K::kPaint, 3.0f, 0.60f, 0.62f, 0.65f, 0.50f);
  m[p::kCarRed] = smooth(K::kPaint, 3.0f, 0.62f, 0.10f, 0.09f, 0.45f);
  m[p::kCarBlue] = smooth(K::kPaint, 3.0f, 0.10f, 0.18f, 0.45f, 0.25f);
  m[p::kCarBlack] = smooth(K::kPaint, 3.0f, 0.06f, 0.06f, 0.07f, 0.07f);
  m[p::kSkin] = smooth(K::kPaint, 1.0f, 0.75f, 0.55f, 0.42f, 0.50f);
  m[p::kClothBlue] = smooth(K::kCloth, 0.9f, 0.3f, 0.5f, 1.1f, 0.45f);
  m[p::kClothRed] = smooth(K::kCloth, 0.9f, 1.2f, 0.35f, 0.3f, 0.50f);
  m[p::kClothGreen] = smooth(K::kCloth, 0.9f, 0.6f, 1.0f, 0.5f, 0.45f);
  m[p::kTrousers] = smooth(K::kCloth, 0.7f, 0.25f, 0.25f, 0.35f, 0.25f);
  m[p::kWood] = surface(K::kBark, 2.5f, 1.5f, 1.3f, 1.0f, 0.45f);
  m[p::kFloor] = surface(K::kFloorTiles, 2.4f, 1.0f, 1.0f, 1.0f, 0.45f);
  m[p::kCorridorWall] = smooth(K::kPlaster, 6.0f, 0.95f, 0.97f, 1.0f, 0.65f);
  m[p::kCeiling] = smooth(K::kConcrete, 2.4f, 1.3f, 1.3f, 1.3f, 0.70f);
  m[p::kLamp] = smooth(K::kPaint, 2.0f, 2.0f, 2.0f, 1.9f, 0.70f);
  m[p::kLamp].glows = true;
  m[p::kDoor] = smooth(K::kBark, 6.0f, 1.4f, 1.1f, 0.8f, 0.45f);
  m[p::kRoof] = surface(K::kConcrete, 4.0f, 0.5f, 0.42f, 0.40f, 0.25f);
  return m;
}

}  // namespace camvox::simulation
