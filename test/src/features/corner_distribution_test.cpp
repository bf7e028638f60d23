#include "camvox/features/corner_distribution.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <random>
#include <set>

namespace camvox::features {
namespace {

/// Distinct corners, most of them crowded into one part of a 600x400 image.
std::vector<Corner> crowded_corners(int count) {
  std::mt19937 random(3);
  std::set<std::pair<int, int>> places;
  std::vector<Corner> corners;
  while (static_cast<int>(corners.size()) < count) {
    const bool crowd = random() % 10 != 0;
    const int u = static_cast<int>(crowd ? 100 + random() % 80 : random() % 600);
    const int v = static_cast<int>(crowd ? 200 + random() % 80 : random() % 400);
    if (!places.insert({u, v}).second) continue;
    corners.push_back({static_cast<std::uint16_t>(u),
                       static_cast<std::uint16_t>(v),
                       static_cast<std::uint8_t>(8 + random() % 100)});
  }
  return corners;
}

TEST(CornerDistribution, GivesExactlyWhatIsWanted) {
  CornerDistribution distribution(0.5);
  std::vector<Corner> chosen;
  for (const int count : {0, 1, 2, 50, 3000}) {
    const auto corners = crowded_corners(count);
    for (const int wanted : {0, 1, 2, 3, 4, 5, 49, 500, 3000}) {
      distribution.choose(corners, wanted, chosen);
      EXPECT_EQ(static_cast<int>(chosen.size()), std::min(wanted, count));
      for (const Corner& corner : chosen) {
        EXPECT_EQ(std::count(corners.begin(), corners.end(), corner), 1);
      }
    }
  }
}

TEST(CornerDistribution, SpreadsOverTheImage) {
  const auto corners = crowded_corners(3000);
  std::vector<Corner> chosen;
  CornerDistribution(1.0).choose(corners, 300, chosen);
  const auto in_crowd = [](const Corner& corner) {
    return corner.u_px >= 100 && corner.u_px < 180 && corner.v_px >= 200 && corner.v_px < 280;
  };
  // 90 % of the corners lie in the crowd, on 3 % of the area.
  const auto crowd = std::count_if(chosen.begin(), chosen.end(), in_crowd);
  EXPECT_LT(crowd, 100);
}

TEST(CornerDistribution, TakesTheStrongestOfEachSquare) {
  // Nine in one square, one far away.
  std::vector<Corner> corners = {{500, 10, 30}};
  for (std::uint16_t i = 0; i < 9; ++i) {
    corners.push_back({static_cast<std::uint16_t>(100 + i % 3),
                       static_cast<std::uint16_t>(100 + i / 3),
                       static_cast<std::uint8_t>(40 + i)});
  }
  std::vector<Corner> chosen;
  CornerDistribution(1.0).choose(corners, 5, chosen);
  EXPECT_THAT(chosen, ::testing::Contains(corners[0]));
  EXPECT_THAT(chosen, ::testing::Contains(corners[9]));
}

TEST(CornerDistribution, TheRestAreTheStrongest) {
  const auto corners = crowded_corners(3000);
  std::vector<Corner> chosen;
  CornerDistribution(0.0).choose(corners, 300, chosen);
  std::vector<int> scores, all;
  for (const Corner& corner : chosen) scores.push_back(corner.score);
  for (const Corner& corner : corners) all.push_back(corner.score);
  std::sort(scores.rbegin(), scores.rend());
  std::sort(all.rbegin(), all.rend());
  // But for the one leaf that a tree always has.
  EXPECT_TRUE(std::equal(scores.begin(), scores.begin() + 299, all.begin()));
}

TEST(CornerDistribution, DoesNotDependOnTheOrderGiven) {
  auto corners = crowded_corners(2000);
  std::vector<Corner> first, second;
  CornerDistribution distribution(0.5);
  distribution.choose(corners, 200, first);
  std::shuffle(corners.begin(), corners.end(), std::mt19937(1));
  distribution.choose(corners, 200, second);
  EXPECT_THAT(second, ::testing::UnorderedElementsAreArray(first));
}

}  // namespace
}  // namespace camvox::features
