#include "camvox/simulation/texture.hpp"

#include <gmock/gmock.h>

namespace camvox::simulation {
namespace {

TEST(Texture, InterpolatesBetweenTexelsAndRepeats) {
  const Texel black = Texel::Zero();
  const Texel white = Texel::Ones();
  const Texture board(2, {black, white, white, black});
  EXPECT_NEAR(board.sample(0.25f, 0.25f, 0.0f)[0], 0.0f, 1e-6f);
  EXPECT_NEAR(board.sample(0.75f, 0.25f, 0.0f)[0], 1.0f, 1e-6f);
  EXPECT_NEAR(board.sample(0.5f, 0.25f, 0.0f)[0], 0.5f, 1e-6f);
  EXPECT_NEAR(board.sample(-2.25f, 7.25f, 0.0f)[0], 1.0f, 1e-6f);
  EXPECT_NEAR(board.sample_grey(0.5f, 0.25f, 0.0f), 0.5f, 1e-6f);
  EXPECT_NEAR(board.sample(1.0f, 1.0f, 0.0f)[0], board.sample(0.0f, 0.0f, 0.0f)[0], 1e-6f);
}

TEST(Texture, LargeFootprintSeesTheMean) {
  std::vector<Texel> texels;
  for (int i = 0; i < 64; ++i) texels.emplace_back(Texel::Constant(static_cast<float>(i) / 63.0f));
  const Texture ramp(8, texels);
  EXPECT_NEAR(ramp.sample(0.3f, 0.8f, 1.0f)[1], 0.5f, 0.01f);
  EXPECT_NEAR(ramp.sample(0.3f, 0.8f, 100.0f)[1], 0.5f, 0.01f);
}

TEST(Texture, RefusesWrongSizes) {
  EXPECT_THROW(Texture(3, std::vector<Texel>(9, Texel::Zero())), std::logic_error);
  EXPECT_THROW(Texture(4, std::vector<Texel>(9, Texel::Zero())), std::logic_error);
  EXPECT_THROW(Texture(0, {}), std::logic_error);
}

/// Correlation of two channels over a texture.
double correlation(const Texture& texture, int a, int b) {
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  constexpr int kSide = 96;
  for (int i = 0; i < kSide * kSide; ++i) {
    const Texel texel = texture.sample(
        static_cast<float>(i % kSide) / kSide, static_cast<float>(i / kSide) / kSide, 0.004f);
    const double x = static_cast<double>(texel[a]);
    const double y = static_cast<double>(texel[b]);
    sa += x, sb += y, saa += x * x, sbb += y * y, sab += x * y;
  }
  constexpr double n = kSide * kSide;
  return (sab - sa * sb / n) / std::sqrt((saa - sa * sa / n) * (sbb - sb * sb / n));
}

TEST(TexturePainter, ReflectivityFollowsTheAlbedoButIsNotTheSame) {
  for (const auto kind : {TextureKind::kAsphalt, TextureKind::kBrick, TextureKind::kPosters}) {
    const double r = correlation(make_texture(kind, 256, 5), 1, 3);
    EXPECT_GT(r, 0.3) << static_cast<int>(kind);
    EXPECT_LT(r, 0.98) << static_cast<int>(kind);
  }
}

TEST(TexturePainter, SeedDecides) {
  const Texture a = make_texture(TextureKind::kBrick, 64, 5);
  const Texture b = make_texture(TextureKind::kBrick, 64, 5);
  const Texture c = make_texture(TextureKind::kBrick, 64, 6);
  EXPECT_TRUE((a.sample(0.3f, 0.3f, 0.0f) == b.sample(0.3f, 0.3f, 0.0f)).all());
  EXPECT_FALSE((a.sample(0.3f, 0.3f, 0.0f) == c.sample(0.3f, 0.3f, 0.0f)).all());
}

}  // namespace
}  // namespace camvox::simulation
