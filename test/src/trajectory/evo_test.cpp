// Our figures against those that evo published for the same files.
#include <gtest/gtest.h>

#include <filesystem>

#include "camvox/trajectory/alignment.hpp"
#include "camvox/trajectory/metrics.hpp"
#include "camvox/trajectory/trajectory_file.hpp"

namespace camvox::trajectory {
namespace {

class EvoTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path folder = SHARED_DATA "/evo";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is absent";
    const auto reference = read_trajectory(folder / "KITTI_00_gt.txt");
    const auto estimate = read_trajectory(folder / "KITTI_00_ORB.txt");
    ASSERT_TRUE(reference.ok()) << reference.status().message();
    ASSERT_TRUE(estimate.ok()) << estimate.status().message();
    pairs_ = associate(*reference, *estimate);
    ASSERT_EQ(pairs_.size(), 4541U);
  }

  std::vector<PosePair> pairs_;
};

// The files have nine digits; the published figures are of the same files.
constexpr double kDigits = 1e-6;

TEST_F(EvoTest, AbsoluteErrorsAfterAlignmentAreEvos) {
  const auto alignment = align(pairs_, Alignment::kSE3);
  ASSERT_TRUE(alignment.has_value());
  const auto figures = statistics(absolute_errors_m(transformed(*alignment, pairs_)));
  EXPECT_NEAR(figures.rmse, 1.3034497145650266, kDigits);
  EXPECT_NEAR(figures.mean, 1.1569971285389768, kDigits);
  EXPECT_NEAR(figures.median, 1.065624769555848, kDigits);
  EXPECT_NEAR(figures.std, 0.6002822693968323, kDigits);
  EXPECT_NEAR(figures.min, 0.06931322021483087, kDigits);
  EXPECT_NEAR(figures.max, 3.587949120678954, kDigits);
  EXPECT_NEAR(figures.sse, 7715.073440292808, 7715.0 * kDigits);
}

TEST_F(EvoTest, RelativeErrorsOver10mAreEvos) {
  std::vector<double> errors;
  for (const auto& error : relative_errors_by_path(pairs_, 10.0)) {
    errors.push_back(error.translation_m);
  }
  const auto figures = statistics(errors);
  EXPECT_NEAR(figures.rmse, 0.22626134329310163, kDigits);
  EXPECT_NEAR(figures.mean, 0.16901737200653275, kDigits);
  EXPECT_NEAR(figures.median, 0.13848432516645606, kDigits);
  EXPECT_NEAR(figures.std, 0.1504238127053164, kDigits);
  EXPECT_NEAR(figures.max, 1.2722090778658726, kDigits);
  EXPECT_NEAR(figures.min, 0.025322719660754993, kDigits);
}

}  // namespace
}  // namespace camvox::trajectory
