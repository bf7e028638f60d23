#include "camvox/lidar/livox.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace camvox::lidar {
namespace {

bool keep(unsigned tag, NoiseConfidence noise) {
  return keep_livox_return(1.0F, 2.0F, 3.0F, static_cast<std::uint8_t>(tag), noise);
}

TEST(KeepLivoxReturn, FollowsTheConfidenceOfBothFields) {
  for (const unsigned shift : {0U, 2U}) {
    for (unsigned confidence = 0; confidence < 4; ++confidence) {
      const unsigned tag = (confidence << shift) | 0x30U;  // bits 4-5: number of the echo
      EXPECT_TRUE(keep(tag, NoiseConfidence::kKeepAll));
      EXPECT_EQ(keep(tag, NoiseConfidence::kHigh), confidence != 1);
      EXPECT_EQ(keep(tag, NoiseConfidence::kModerate), confidence == 0 || confidence == 3);
      EXPECT_EQ(keep(tag, NoiseConfidence::kLow), confidence == 0);
    }
  }
}

TEST(KeepLivoxReturn, DropsWhatIsNoPoint) {
  const auto all = NoiseConfidence::kKeepAll;
  EXPECT_FALSE(keep_livox_return(0.0F, 0.0F, 0.0F, 0, all));
  EXPECT_FALSE(keep_livox_return(std::numeric_limits<float>::quiet_NaN(), 1.0F, 1.0F, 0, all));
  EXPECT_FALSE(keep_livox_return(1.0F, std::numeric_limits<float>::infinity(), 1.0F, 0, all));
  EXPECT_TRUE(keep_livox_return(0.0F, 0.0F, 0.01F, 0, all));
}

}  // namespace
}  // namespace camvox::lidar
