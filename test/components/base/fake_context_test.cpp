#include "camvox/component/fake_context.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <deque>
#include <thread>

#include "camvox/component/component.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/composition_interfaces.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Cloud;
using sensor_msgs::msg::Imu;
using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;

struct CropConfig {
  double max_range_m = 10.0;
  bool keep_input = false;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("max_range_m", self.max_range_m, config::greater_than(0.0));
    field("keep_input", self.keep_input);
  }
};

/// Drops far points. Wired with everything that a context offers.
class CropComponent final : public Component {
 public:
  explicit CropComponent(Context& context)
      : context_(context),
        config_(context.parameters<CropConfig>()),
        output_(context.advertise<Cloud>({"near", "/near"})),
        imu_output_(context.advertise<Imu>({"imu_out", "/imu_out"})),
        raw_output_(context.advertise_raw({"raw_out", "/raw_out"}, "std_msgs/msg/Header")) {
    context.subscribe<Cloud>({"cloud", "/cloud"}, [this](const auto& cloud) { crop(cloud); });
    context.subscribe<Imu>({"imu", "/imu"}, [this](const auto& imu) { imu_output_.publish(*imu); });
    context.subscribe_raw({"raw", "/raw"}, "std_msgs/msg/Header", [this](const auto& raw) {
      raw_output_.publish(*raw);
    });
    context.every(100ms, [this] { ticks_ns.push_back(context_.now_ns()); });
    context.on_parameter_change<CropConfig>(config_, [this](const auto& next) { config_ = next; });
  }

  void crop(const Sample<Cloud>& cloud) {
    if (cloud->points_count() == 0) throw std::runtime_error("empty cloud");
    if (config_.keep_input) kept.push_back(cloud);
    infos.push_back(cloud.info());
    auto near = output_.loan();
    for (std::uint32_t i = 0; i < cloud->points_count(); ++i) {
      if (cloud->points()[i][0] > config_.max_range_m) continue;
      near->points()[near->points_count()++] = cloud->points()[i];
    }
    if (near->points_count() == 0) return context_.log().warn("no point within range");
    output_.publish(std::move(near));
  }

  std::deque<Sample<Cloud>> kept;
  std::vector<MessageInfo> infos;
  std::vector<std::int64_t> ticks_ns;

 private:
  Context& context_;
  CropConfig config_;
  Publisher<Cloud> output_;
  Publisher<Imu> imu_output_;
  Publisher<RawMessage> raw_output_;
};

/// A cloud with points at these distances.
auto at(std::vector<float> distances_m) {
  return [distances_m](Cloud& cloud) {
    for (const float x_m : distances_m) cloud.points()[cloud.points_count()++] = {x_m, 0, 0, 0};
  };
}

TEST(FakeContext, TakesMessagesInAndOut) {
  FakeContext fake;
  CropComponent component(fake);
  fake.send<Cloud>("cloud", at({1, 20, 3}));
  fake.send<Cloud>("cloud", at({4}));
  const auto clouds = fake.published<Cloud>("near");
  ASSERT_THAT(clouds, SizeIs(2));
  ASSERT_EQ(clouds[0]->points_count(), 2U);
  EXPECT_EQ(clouds[0]->points()[1][0], 3.0F);
  EXPECT_EQ(clouds[1]->points_count(), 1U);
  EXPECT_NO_THROW(fake.verify_nothing_left());
}

TEST(FakeContext, PassesOnWhatAnotherComponentPublished) {
  FakeContext first, second;
  CropComponent cropping(first), again(second);
  first.send<Cloud>("cloud", at({1, 20, 3}));
  const auto taken = first.take_published<Cloud>("near");
  ASSERT_THAT(taken, SizeIs(1));
  EXPECT_THAT(first.published<Cloud>("near"), SizeIs(0)) << "taken is gone";
  second.pass_on("cloud", taken[0]);
  ASSERT_THAT(second.published<Cloud>("near"), SizeIs(1));
  EXPECT_EQ(second.published<Cloud>("near")[0]->points_count(), 2U);
  EXPECT_THROW(second.pass_on("cloud", std::shared_ptr<const Imu>()), std::logic_error);
}

TEST(FakeContext, CopiesRosAndRawMessages) {
  FakeContext fake;
  CropComponent component(fake);
  Imu imu;
  imu.header().frame_id() = "imu";
  imu.angular_velocity().z() = 0.25;
  fake.send("imu", imu);
  fake.send("raw", RawMessage{{0, 1, 0, 0, 42}});
  ASSERT_THAT(fake.published<Imu>("imu_out"), SizeIs(1));
  EXPECT_EQ(*fake.published<Imu>("imu_out")[0], imu);
  ASSERT_THAT(fake.published<RawMessage>("raw_out"), SizeIs(1));
  EXPECT_THAT(fake.published<RawMessage>("raw_out")[0]->cdr, ElementsAre(0, 1, 0, 0, 42));
}

TEST(FakeContext, NewPlainMessagesAreZeroExceptForTheirRows) {
  FakeContext fake;
  auto publisher = fake.advertise<Cloud>({"out", "/out"});
  auto loan = publisher.loan();
  EXPECT_EQ(loan->points_count(), 0U);
  EXPECT_EQ(loan->header().stamp_ns(), 0);
  EXPECT_NE(loan->points()[0][0], 0.0F);
}

TEST(FakeContext, ChecksParametersAndAppliesChanges) {
  FakeContext fake;
  fake.set_parameter("max_range_m", 2.0);
  CropComponent component(fake);
  EXPECT_EQ(fake.effective_parameters().at("max_range_m").value, config::Value(2.0));
  const config::ParameterMap wider = {{"max_range_m", {5.0, {}}}};
  const config::ParameterMap impossible = {{"max_range_m", {-1.0, {}}}};
  EXPECT_THAT(fake.change_parameters(wider), IsEmpty());
  EXPECT_THAT(fake.change_parameters(impossible), SizeIs(1));
  EXPECT_EQ(fake.effective_parameters().at("max_range_m").value, config::Value(5.0));
  fake.send<Cloud>("cloud", at({4, 6}));
  EXPECT_EQ(fake.published<Cloud>("near").at(0)->points_count(), 1U);
}

TEST(FakeContext, RefusesBadParametersAndChangesOfFixedOnes) {
  FakeContext bad;
  bad.set_parameter("max_range", 2.0);
  EXPECT_THAT([&] { CropComponent component(bad); },
              ThrowsMessage<config::ConfigError>(HasSubstr("max_range_m")));
  FakeContext fixed;
  EXPECT_THAT(fixed.change_parameters({{"max_range_m", {2.0, {}}}}), SizeIs(1));
}

TEST(FakeContext, FiresTimersByTheManualClock) {
  FakeContext fake;
  CropComponent component(fake);
  fake.set_now_ns(fake.now_ns() - 50'000'000);
  const auto start_ns = fake.now_ns();
  fake.advance(149ms);
  EXPECT_THAT(component.ticks_ns, IsEmpty());
  fake.advance(1ms);
  fake.advance(200ms);
  EXPECT_THAT(component.ticks_ns,
              ElementsAre(start_ns + 150'000'000, start_ns + 250'000'000, start_ns + 350'000'000));
  EXPECT_EQ(fake.now_ns(), start_ns + 350'000'000);
}

TEST(FakeContext, InterleavesTimersInOrderOfTime) {
  FakeContext fake;
  std::string order;
  fake.every(30ms, [&] { order += 'a'; });
  fake.every(20ms, [&] { order += 'b'; });
  fake.advance(60ms);
  EXPECT_EQ(order, "babab") << "b at 20, a at 30, b at 40, both at 60 in order of registration";
}

TEST(FakeContext, RunsPostedWorkOnceAndWaitsForOtherThreads) {
  FakeContext fake;
  int runs = 0;
  fake.post([&] {
    ++runs;
    fake.post([&] { ++runs; });
  });
  EXPECT_EQ(fake.run_posted(), 1U);
  EXPECT_EQ(fake.run_posted(), 1U);
  EXPECT_EQ(fake.run_posted(), 0U);
  EXPECT_EQ(runs, 2);
  std::jthread other([&] { fake.post([&] { ++runs; }); });
  EXPECT_EQ(fake.run_posted(10s), 1U);
  EXPECT_EQ(runs, 3);
}

TEST(FakeContext, CapturesLogAndDiagnostics) {
  FakeContext fake("crop");
  CropComponent component(fake);
  fake.send<Cloud>("cloud", at({99}));
  ASSERT_THAT(fake.log_entries(), SizeIs(1));
  EXPECT_EQ(fake.log_entries()[0].level, LogLevel::kWarn);
  EXPECT_EQ(fake.log_entries()[0].text, "no point within range");
  EXPECT_EQ(fake.discarded_loans("near"), 1U);
  fake.diagnostics().report(HealthLevel::kWarn, "slow");
  EXPECT_EQ(fake.diagnostics().status().message, "slow");
  EXPECT_EQ(fake.name(), "crop");
}

TEST(FakeContext, ExceptionsReachTheTestAndDeliveryGoesOn) {
  FakeContext fake;
  CropComponent component(fake);
  EXPECT_THROW(fake.send<Cloud>("cloud", at({})), std::runtime_error);
  fake.send<Cloud>("cloud", at({1}));
  EXPECT_THAT(fake.published<Cloud>("near"), SizeIs(1));
  EXPECT_NO_THROW(fake.verify_nothing_left());
}

TEST(FakeContext, LoanPoolIsCountedAndLeaksAreNamed) {
  FakeContext fake;
  auto publisher = fake.advertise<Cloud>({"out", "/out"}, {.max_loans = 2});
  auto first = publisher.loan();
  auto second = publisher.loan();
  EXPECT_THAT([&] { (void)publisher.loan(); }, ThrowsMessage<LoanError>(HasSubstr("'out'")));
  EXPECT_EQ(fake.outstanding_loans("out"), 2U);
  EXPECT_THAT([&] { fake.verify_nothing_left(); },
              ThrowsMessage<std::logic_error>(HasSubstr("'out': 2 loans")));
  publisher.publish(std::move(first));
  second = publisher.loan();  // drops the loan that it replaces
  EXPECT_EQ(fake.outstanding_loans("out"), 1U);
  EXPECT_EQ(fake.discarded_loans("out"), 1U);
}

TEST(FakeContext, PublishingTwiceIsAnError) {
  FakeContext fake;
  auto publisher = fake.advertise<Cloud>({"out", "/out"});
  auto loan = publisher.loan();
  publisher.publish(std::move(loan));
  EXPECT_THROW(publisher.publish(std::move(loan)), std::logic_error);
}

TEST(FakeContext, HoldingTooManySamplesStopsDelivery) {
  FakeContext fake;
  fake.set_parameter("keep_input", true);
  CropComponent component(fake);  // may hold 2, queue of 10
  for (int i = 0; i < 14; ++i) fake.send<Cloud>("cloud", at({1}));
  EXPECT_THAT(component.infos, SizeIs(3));
  auto stats = fake.subscription_stats("cloud");
  EXPECT_EQ(stats.received, 3U);
  EXPECT_EQ(stats.starved, 11U);
  EXPECT_EQ(stats.lost, 1U);
  component.kept.pop_front();
  fake.run_posted();
  ASSERT_THAT(component.infos, SizeIs(4));
  EXPECT_EQ(component.infos[3].sequence, 5U);
  EXPECT_EQ(component.infos[3].lost_before, 1U);
  component.kept.clear();
}

TEST(FakeContext, SamplesMayOutliveTheContext) {
  std::deque<Sample<Cloud>> kept;
  {
    FakeContext fake;
    fake.subscribe<Cloud>({"in", "/in"}, [&](const auto& cloud) { kept.push_back(cloud); });
    fake.send<Cloud>("in", at({7}));
  }
  EXPECT_EQ(kept.at(0)->points()[0][0], 7.0F);
}

TEST(FakeContext, NamesWhatIsWrongInTheTest) {
  FakeContext fake;
  CropComponent component(fake);
  EXPECT_THAT([&] { fake.send<Cloud>("clod", at({1})); },
              ThrowsMessage<std::logic_error>(HasSubstr("'clod'; it has [cloud, imu, raw]")));
  EXPECT_THAT([&] { (void)fake.published<Cloud>("cloud"); },
              ThrowsMessage<std::logic_error>(HasSubstr("[imu_out, near, raw_out]")));
  EXPECT_THAT([&] { fake.send("cloud", Imu()); },
              ThrowsMessage<std::logic_error>(
                  HasSubstr("carries camvox_interfaces/msg/Cloud, not sensor_msgs/msg/Imu")));
  EXPECT_THAT([&] { (void)fake.published<Imu>("near"); },
              ThrowsMessage<std::logic_error>(HasSubstr("not sensor_msgs/msg/Imu")));
  EXPECT_THAT([&] { fake.send("raw", Imu()); },
              ThrowsMessage<std::logic_error>(HasSubstr("serialised std_msgs/msg/Header")));
  EXPECT_THAT(
      [&] {
        fake.subscribe<Imu>({"imu", "/imu"}, [](const auto&) {});
      },
      ThrowsMessage<std::logic_error>(HasSubstr("twice")));
}

TEST(FakeContext, RefusesCountersOverCapacity) {
  FakeContext fake;
  CropComponent component(fake);
  const auto overfull = [](Cloud& cloud) {
    cloud.points_count() = camvox_interfaces::msg::SCAN_POINTS + 1;
  };
  EXPECT_THAT([&] { fake.send<Cloud>("cloud", overfull); },
              ThrowsMessage<std::logic_error>(HasSubstr("capacity")));
  auto publisher = fake.advertise<Cloud>({"out", "/out"});
  auto loan = publisher.loan();
  overfull(*loan);
  EXPECT_THAT([&] { publisher.publish(std::move(loan)); },
              ThrowsMessage<std::logic_error>(HasSubstr("capacity")));
  EXPECT_THAT(fake.published<Cloud>("out"), IsEmpty());
}

TEST(FakeContext, CallsTheServicesOfTheComponent) {
  using composition_interfaces::srv::UnloadNode_Request;
  using composition_interfaces::srv::UnloadNode_Response;
  FakeContext fake;
  fake.serve<UnloadNode_Request, UnloadNode_Response>(
      {"unload", "/unload"}, [](const auto& request, auto& response) {
        response.error_message("no " + std::to_string(request.unique_id()));
      });
  UnloadNode_Request request;
  request.unique_id(4);
  const auto answer = fake.call<UnloadNode_Request, UnloadNode_Response>("unload", request);
  EXPECT_EQ(answer.error_message(), "no 4");
  EXPECT_THROW(((void)fake.call<UnloadNode_Request, UnloadNode_Response>("load", request)),
               std::logic_error);
  EXPECT_THROW(((void)fake.call<UnloadNode_Response, UnloadNode_Response>("unload", answer)),
               std::logic_error);
}

TEST(FakeContext, SubscriberCountIsTheTests) {
  FakeContext fake;
  auto publisher = fake.advertise<Cloud>({"out", "/out"});
  EXPECT_EQ(publisher.subscriber_count(), 1U);
  fake.set_subscriber_count("out", 0);
  EXPECT_EQ(publisher.subscriber_count(), 0U);
}

}  // namespace
}  // namespace camvox
