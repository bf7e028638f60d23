#include "camvox/features/hamming.hpp"

#include <gmock/gmock.h>

#include <random>
#include <stdexcept>
#include <vector>

namespace camvox::features {
namespace {

std::vector<Descriptor> random_descriptors(std::size_t count) {
  std::mt19937 random(9);
  std::vector<Descriptor> descriptors(count);
  for (auto& descriptor : descriptors) {
    for (auto& byte : descriptor.bytes) byte = static_cast<std::uint8_t>(random());
  }
  return descriptors;
}

int slow_distance(const Descriptor& a, const Descriptor& b) {
  int bits = 0;
  for (std::size_t i = 0; i < 256; ++i) bits += ((a.bytes[i / 8] ^ b.bytes[i / 8]) >> (i % 8)) & 1;
  return bits;
}

TEST(Hamming, CountsDifferingBits) {
  const auto descriptors = random_descriptors(40);
  std::vector<std::uint16_t> distances(descriptors.size());
  for (const Descriptor& a : descriptors) {
    hamming_distances(a, descriptors, distances);
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      EXPECT_EQ(hamming_distance(a, descriptors[i]), slow_distance(a, descriptors[i]));
      EXPECT_EQ(distances[i], slow_distance(a, descriptors[i]));
    }
  }
  Descriptor ones;
  ones.bytes.fill(0xff);
  EXPECT_EQ(hamming_distance(ones, Descriptor{}), kDescriptorBits);
  const std::vector<std::uint32_t> some = {39, 2, 2};
  distances.resize(3);
  hamming_distances(ones, descriptors, some, distances);
  EXPECT_EQ(distances[0], slow_distance(ones, descriptors[39]));
  EXPECT_EQ(distances[2], slow_distance(ones, descriptors[2]));
  EXPECT_THROW(hamming_distances(ones, descriptors, some, {}), std::logic_error);
  EXPECT_THROW(hamming_distances(ones, descriptors, {}), std::logic_error);
}

TEST(Hamming, FindsTheNearestTwo) {
  const auto descriptors = random_descriptors(60);
  const std::vector<std::uint32_t> candidates = {3, 50, 7, 8, 21, 3};
  const Nearest nearest = nearest_descriptor(descriptors[0], descriptors, candidates);
  std::vector<int> sorted;
  for (const auto c : candidates) sorted.push_back(slow_distance(descriptors[0], descriptors[c]));
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(nearest.distance, sorted[0]);
  EXPECT_EQ(nearest.second_distance, sorted[1]);
  EXPECT_EQ(slow_distance(descriptors[0], descriptors[static_cast<std::size_t>(nearest.index)]),
            sorted[0]);
}

TEST(Hamming, NothingIsNearestToNone) {
  const auto descriptors = random_descriptors(2);
  EXPECT_EQ(nearest_descriptor(descriptors[0], descriptors, {}).index, -1);
  const std::vector<std::uint32_t> one = {1};
  EXPECT_EQ(nearest_descriptor(descriptors[0], descriptors, one).second_distance,
            kDescriptorBits + 1);
}

TEST(Hamming, TheMedianDescriptorIsInTheMiddle) {
  EXPECT_EQ(median_descriptor({}), -1);
  std::vector<Descriptor> descriptors(5);
  descriptors[0].bytes.fill(0xff);  // an outlier
  for (std::size_t i = 1; i < 5; ++i)
    descriptors[i].bytes[0] = static_cast<std::uint8_t>((1U << i) - 1);
  EXPECT_EQ(median_descriptor(descriptors), 2);
  EXPECT_EQ(median_descriptor(std::span(descriptors).first(1)), 0);
}

}  // namespace
}  // namespace camvox::features
