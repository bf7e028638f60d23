#include <gmock/gmock.h>

#include <mutex>

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/test/child_process.hpp"
#include "camvox/test/dds_domain.hpp"
#include "camvox/test/deadline.hpp"
#include "camvox/test/test_container.hpp"
#include "pattern.h"

namespace camvox {
namespace {

using camvox_interfaces::msg::Cloud;
using sensor_msgs::msg::Imu;
using sensor_msgs::msg::PointCloud2;
using sensor_msgs::msg::PointField;
using test::wait_until;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr Port kImuPort{"imu", topics::kImu};
constexpr Port kLidarPort{"lidar", topics::kLidar};
constexpr Port kCloudPort{"cloud", topics::kCloud};

/// Cyclone on the loopback interface without multicast, as our containers are by default.
constexpr auto kCycloneConfig = R"(
<CycloneDDS><Domain>
  <General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
    <AllowMulticast>false</AllowMulticast></General>
  <Discovery><ParticipantIndex>auto</ParticipantIndex>
    <MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>
    <Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>)";

test::ChildProcess start_cyclone(const char* program, std::vector<std::string> arguments) {
  std::vector<std::string> command = {program, std::to_string(test::own_domain())};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return test::ChildProcess(command, {{"CYCLONEDDS_URI", kCycloneConfig}});
}

void fill(std_msgs::msg::Header& header, int m) {
  header.stamp().sec(pattern_sec(m));
  header.stamp().nanosec(pattern_nanosec(m));
  header.frame_id(kFrame);
}

Imu expected_imu(int m) {
  Imu imu;
  fill(imu.header(), m);
  int place = 0;
  const auto next = [&] { return pattern_double(m, place++); };
  for (double* value : {&imu.orientation().x(), &imu.orientation().y(), &imu.orientation().z()}) {
    *value = next();
  }
  imu.orientation().w(next());
  for (double& value : imu.orientation_covariance()) value = next();
  imu.angular_velocity().x(next());
  imu.angular_velocity().y(next());
  imu.angular_velocity().z(next());
  for (double& value : imu.angular_velocity_covariance()) value = next();
  imu.linear_acceleration().x(next());
  imu.linear_acceleration().y(next());
  imu.linear_acceleration().z(next());
  for (double& value : imu.linear_acceleration_covariance()) value = next();
  EXPECT_EQ(place, kImuDoubles);
  return imu;
}

PointCloud2 expected_lidar(int m) {
  PointCloud2 cloud;
  fill(cloud.header(), m);
  cloud.height(1);
  cloud.width(kPoints);
  cloud.point_step(kPointBytes);
  cloud.row_step(kPoints * kPointBytes);
  cloud.is_dense(true);
  for (std::size_t i = 0; i < kPointFields; ++i) {
    PointField field;
    field.name(kFieldNames[i]);
    field.offset(kFieldOffsets[i]);
    field.datatype(kFieldTypes[i]);
    field.count(1);
    cloud.fields().push_back(field);
  }
  cloud.data().resize(cloud.row_step());
  for (std::uint32_t i = 0; i < cloud.row_step(); ++i) cloud.data()[i] = pattern_byte(m, i);
  return cloud;
}

PointCloud2 small_primer() {
  PointCloud2 cloud;
  fill(cloud.header(), kPrimer);
  return cloud;
}

void fill_internal(Cloud& cloud, int m) {
  cloud.header().stamp_ns(pattern_sec(m) * std::int64_t{1'000'000'000});
  cloud.header().frame_id(static_cast<std::uint64_t>(m) + 1);
  for (std::size_t i = 0; i < 3; ++i) {
    cloud.angular_velocity_lidar()[i] = pattern_double(m, static_cast<int>(i));
    cloud.velocity_lidar()[i] = pattern_double(m, 3 + static_cast<int>(i));
  }
  for (std::size_t i = 0; i < 4; ++i) {
    cloud.rotation_imu()[i] = pattern_double(m, 6 + static_cast<int>(i));
  }
  cloud.deskew(1);
  cloud.stationary(1);
  cloud.points_count(kInternalPoints);
  for (std::uint32_t i = 0; i < kInternalPoints * 4; ++i) {
    cloud.points()[i / 4][i % 4] = pattern_float(m, i);
  }
}

/// Messages of one topic, collected on the executor's thread.
template <typename T>
class Inbox {
 public:
  Inbox(Context& context, const Port& port)
      : subscription_(context.subscribe<T>(port, [this](const Sample<T>& sample) {
          const std::lock_guard lock(mutex_);
          cdr_.push_back(interfaces::message_type<T>().to_cdr(&*sample));
        })) {}
  [[nodiscard]] std::vector<std::vector<std::uint8_t>> messages() const {
    const std::lock_guard lock(mutex_);
    return cdr_;
  }
  [[nodiscard]] std::size_t count() const { return messages().size(); }
  [[nodiscard]] SubscriptionStats stats() const { return subscription_->stats(); }

 private:
  mutable std::mutex mutex_;
  std::vector<std::vector<std::uint8_t>> cdr_;
  Subscription subscription_;
};

template <typename T>
void expect_equal(const std::vector<std::uint8_t>& received, const T& expected) {
  EXPECT_TRUE(received == interfaces::message_type<T>().to_cdr(&expected));
}

TEST(CycloneInterop, ReadsWhatCycloneWrites) {
  test::TestContainer container;
  auto& context = container.component();
  const Inbox<Imu> imu(context, kImuPort);
  const Inbox<PointCloud2> lidar(context, kLidarPort);
  const Inbox<Cloud> cloud(context, kCloudPort);
  container.activate();
  auto cyclone = start_cyclone(CYCLONE_PEER, {"publish"});
  ASSERT_TRUE(cyclone.wrote("published")) << cyclone.output();
  EXPECT_TRUE(wait_until([&] {
    return imu.count() == kMessages && lidar.count() == kMessages && cloud.count() == kMessages;
  })) << imu.count()
      << " imu, " << lidar.count() << " lidar, " << cloud.count() << " cloud";
  ASSERT_EQ(imu.count() + lidar.count() + cloud.count(), 3U * kMessages);
  const auto expected_cloud = std::make_unique<Cloud>();
  for (int m = 0; m < kMessages; ++m) {
    const auto at = static_cast<std::size_t>(m);
    expect_equal(imu.messages()[at], expected_imu(m));
    expect_equal(lidar.messages()[at], expected_lidar(m));
    fill_internal(*expected_cloud, m);
    expect_equal(cloud.messages()[at], *expected_cloud);
  }
  cyclone.tell("done");
  EXPECT_EQ(cyclone.wait(), 0) << cyclone.output();
  EXPECT_EQ(imu.stats().lost + lidar.stats().lost + cloud.stats().lost, 0U);
}

TEST(CycloneInterop, WritesWhatCycloneReads) {
  test::TestContainer container;
  auto& context = container.component();
  auto imu = context.advertise<Imu>(kImuPort);
  auto lidar = context.advertise<PointCloud2>(kLidarPort);
  auto cloud = context.advertise<Cloud>(kCloudPort);
  container.activate();
  auto cyclone = start_cyclone(CYCLONE_PEER, {"subscribe"});
  const auto publish = [&](int m) {
    imu.publish(expected_imu(m));
    lidar.publish(m == kPrimer ? small_primer() : expected_lidar(m));
    auto sample = cloud.loan();
    fill_internal(*sample, m);
    cloud.publish(std::move(sample));
  };
  ASSERT_TRUE(wait_until([&] {
    publish(kPrimer);
    return cyclone.wrote("hears all", std::chrono::milliseconds(20));
  })) << cyclone.output();
  for (int m = 0; m < kMessages; ++m) publish(m);
  EXPECT_TRUE(cyclone.wrote("received")) << cyclone.output();
  cyclone.tell("done");
  EXPECT_EQ(cyclone.wait(), 0) << cyclone.output();
}

TEST(CycloneInterop, RejectsOtherContentsUnderTheSameTypeName) {
  test::TestContainer container;
  auto& context = container.component();
  const Inbox<Imu> imu(context, kImuPort);
  const Inbox<Cloud> cloud(context, kCloudPort);
  container.activate();
  auto impostor = start_cyclone(CYCLONE_IMPOSTOR, {});
  ASSERT_TRUE(impostor.wrote("published")) << impostor.output();
  EXPECT_TRUE(wait_until([&] { return imu.stats().rejected == 3 && cloud.count() == 1; }))
      << imu.stats().rejected << " rejected, " << cloud.count() << " clouds";
  EXPECT_EQ(imu.count(), 0U);
  const auto expected = std::make_unique<Cloud>();
  expected->header().stamp_ns(1);
  expected->header().frame_id(8);
  expected->points_count(2);
  ASSERT_EQ(cloud.count(), 1U);
  expect_equal(cloud.messages()[0], *expected);
  EXPECT_EQ(cloud.stats().rejected, 2U);
  EXPECT_THAT(container.errors(), IsEmpty());
  impostor.tell("done");
  EXPECT_EQ(impostor.wait(), 0) << impostor.output();
}

}  // namespace
}  // namespace camvox
