#include "camvox/interfaces/header.hpp"

#include <gtest/gtest.h>

namespace camvox::interfaces {
namespace {

TEST(Header, SplitsAMomentIntoSecondsAndTheRest) {
  const auto header = to_header(1'305'031'102'175'304'000, "camera");
  EXPECT_EQ(header.stamp().sec(), 1'305'031'102);
  EXPECT_EQ(header.stamp().nanosec(), 175'304'000U);
  EXPECT_EQ(header.frame_id(), "camera");
}

/// 2^31 - 1 s is the last second that a ROS header can hold (2038).
TEST(Header, GivesTheMomentBack) {
  constexpr std::int64_t kLast_ns = 2'147'483'647'999'999'999;
  for (const std::int64_t stamp_ns : {std::int64_t{0}, std::int64_t{999'999'999}, kLast_ns}) {
    EXPECT_EQ(stamp_of(to_header(stamp_ns, "")), stamp_ns);
  }
}

}  // namespace
}  // namespace camvox::interfaces
