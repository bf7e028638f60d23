#include <gmock/gmock.h>

#include "sync_fixture.hpp"

namespace camvox {
namespace {

using ::testing::HasSubstr;
using MissingInputs = test::SyncTest;

TEST_F(MissingInputs, NamesTheInputThatNothingCameOn) {
  make();
  image_at(100);
  scan_at(0);
  for (int second = 0; second < 4; ++second) fake_.advance(std::chrono::seconds(1));
  EXPECT_TRUE(fake_.log_entries().empty()) << "a driver may start late";
  fake_.advance(std::chrono::seconds(1));
  component_->stop();
  ASSERT_EQ(fake_.log_entries().size(), 2U);
  EXPECT_THAT(fake_.log_entries()[0].text, HasSubstr("input 'imu' (topic /livox/imu)"));
  EXPECT_THAT(fake_.log_entries()[1].text, HasSubstr("images: 1 came, of which 1 "));
}

TEST_F(MissingInputs, NamesTheTopicsThatItReallyReads) {
  fake_.set_topic_of("compressed_image", "/front/jpeg");
  fake_.set_topic_of("imu", "/front/imu");
  make();
  scan_at(0);
  component_->stop();
  ASSERT_EQ(fake_.log_entries().size(), 2U);
  EXPECT_EQ(fake_.log_entries()[0].text,
            "nothing came on input 'image' (topic /camera/image_raw or /front/jpeg)");
  EXPECT_EQ(fake_.log_entries()[1].text, "nothing came on input 'imu' (topic /front/imu)");
}

TEST_F(MissingInputs, OneTransportIsOneTopic) {
  fake_.set_parameter("image_transport", std::string("compressed"));
  make();
  imu_between(0, 10);
  scan_at(0);
  component_->stop();
  ASSERT_EQ(fake_.log_entries().size(), 1U);
  EXPECT_EQ(fake_.log_entries()[0].text,
            "nothing came on input 'compressed_image' (topic /camera/image_raw/compressed)");
}

}  // namespace
}  // namespace camvox
