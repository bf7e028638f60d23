#include "camvox/component/progress.hpp"

#include <gtest/gtest.h>

#include "camvox/component/fake_context.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Progress;

void burn(double time_s) {
  const double end_s = thread_processor_time_s() + time_s;
  while (thread_processor_time_s() < end_s) {
  }
}

camvox_interfaces::msg::MessageHeader header_of(std::uint64_t frame_id) {
  camvox_interfaces::msg::MessageHeader header;
  header.stamp_ns(static_cast<std::int64_t>(frame_id) * 100);
  header.frame_id(frame_id);
  return header;
}

TEST(ProgressReporter, NamesTheComponentAndTheFrame) {
  FakeContext context("deskew");
  ProgressReporter progress(context);
  progress.done(header_of(3));
  const auto sent = context.published<Progress>("progress");
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_STREQ(sent[0]->component_name().data(), "deskew");
  EXPECT_EQ(sent[0]->header().frame_id(), 3U);
  EXPECT_EQ(sent[0]->header().stamp_ns(), 300);
}

// Burnt processor time is exact from below; from above another measurement bounds it.
TEST(ProgressReporter, AddsUpTheProcessorTimeOfEachFrame) {
  FakeContext context;
  ProgressReporter progress(context);
  const double start_s = thread_processor_time_s();
  {
    const auto work = progress.measure();
    burn(0.002);
  }
  {
    const auto work = progress.measure();
    const auto nested = progress.measure();
    burn(0.003);
    progress.done(header_of(1));
    burn(0.001);
  }
  progress.add(0.5);
  progress.done(header_of(2));
  const double total_s = thread_processor_time_s() - start_s;
  const auto sent = context.published<Progress>("progress");
  ASSERT_EQ(sent.size(), 2U);
  EXPECT_GE(sent[0]->processing_time_s(), 0.005);
  EXPECT_GE(sent[1]->processing_time_s(), 0.501);
  EXPECT_LE(sent[0]->processing_time_s() + sent[1]->processing_time_s(), 0.5 + total_s);
}

TEST(ProgressReporter, CutsANameThatIsTooLong) {
  FakeContext context(std::string(100, 'x'));
  ProgressReporter progress(context);
  progress.done(header_of(1));
  EXPECT_STREQ(context.published<Progress>("progress")[0]->component_name().data(),
               std::string(47, 'x').c_str());
}

}  // namespace
}  // namespace camvox
