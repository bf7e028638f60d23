#include "camvox/mapping_component/job_runner.hpp"

#include <gtest/gtest.h>

#include <future>
#include <stdexcept>

namespace camvox::mapping_component {
namespace {

class JobRunnerTest : public testing::Test {
 protected:
  [[nodiscard]] SolvedJob wait() {
    auto solved = solved_.get_future().get();
    solved_ = {};
    return solved;
  }

  std::promise<SolvedJob> solved_;
  JobRunner runner_{[this](SolvedJob solved) { solved_.set_value(std::move(solved)); }};
};

TEST_F(JobRunnerTest, IsBusyUntilItsOwnerHasSeenToTheJob) {
  EXPECT_FALSE(runner_.busy());
  runner_.start({});
  EXPECT_TRUE(runner_.busy());
  EXPECT_FALSE(wait().error);
  EXPECT_TRUE(runner_.busy()) << "solved, but the map does not know yet";
  EXPECT_THROW(runner_.start({}), std::logic_error);
  runner_.release();
  EXPECT_FALSE(runner_.busy());
}

TEST_F(JobRunnerTest, HandsOverWhatWasThrownAndGoesOn) {
  mapping::BundleJob broken;
  broken.problem.observations.resize(1);  // of a pose that is not there
  runner_.start(broken);
  EXPECT_THROW(std::rethrow_exception(wait().error), std::logic_error);
  runner_.release();
  runner_.start({});
  EXPECT_FALSE(wait().error);
}

}  // namespace
}  // namespace camvox::mapping_component
