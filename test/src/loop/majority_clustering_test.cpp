#include "majority_clustering.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "camvox/test/feature_world.hpp"

namespace camvox::loop {
namespace {

using features::Descriptor;

TEST(MajorityClusteringTest, FindsGroupsAndTheirCentres) {
  std::mt19937 random(1);
  std::vector<Descriptor> centres, members;
  for (int i = 0; i < 4; ++i) centres.push_back(test::FeatureWorld::random_descriptor(random));
  for (int i = 0; i < 80; ++i) {
    auto member = centres[static_cast<std::size_t>(i) % 4];
    for (int k = 0; k < 10; ++k) {
      auto& byte = member.bytes[random() % 32];
      byte = static_cast<std::uint8_t>(byte ^ (1U << (random() % 8)));
    }
    members.push_back(member);
  }
  const auto groups = cluster(members, 4);
  ASSERT_EQ(groups.centres.size(), 4U);
  for (std::size_t i = 0; i < 80; ++i) {
    EXPECT_EQ(groups.assignment[i], groups.assignment[i % 4]);
    // Ten wrong bits of 256 in each of twenty members: no majority is wrong.
    EXPECT_EQ(groups.centres[groups.assignment[i]], centres[i % 4]);
  }
}

TEST(MajorityClusteringTest, OneGroupOfTheSameAndNoneOfNothing) {
  std::mt19937 random(1);
  const std::vector<Descriptor> same(30, test::FeatureWorld::random_descriptor(random));
  EXPECT_EQ(cluster(same, 8).centres.size(), 1U);
  EXPECT_TRUE(cluster({}, 8).centres.empty());
}

TEST(MajorityClusteringTest, NoGroupIsEmpty) {
  std::mt19937 random(2);
  std::vector<Descriptor> members;
  for (int i = 0; i < 100; ++i) members.push_back(test::FeatureWorld::random_descriptor(random));
  const auto groups = cluster(members, 8);
  const std::set<std::size_t> used(groups.assignment.begin(), groups.assignment.end());
  EXPECT_EQ(used.size(), groups.centres.size());
}

}  // namespace
}  // namespace camvox::loop
