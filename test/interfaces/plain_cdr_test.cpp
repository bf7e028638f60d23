#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <gmock/gmock.h>

#include <cstdlib>
#include <random>

#include "camvox/test/plain_messages.hpp"
#include "camvox/test/plain_type_list.hpp"
#include "schema_walker.hpp"

namespace camvox::interfaces {
namespace {

using camvox_interfaces::msg::Cloud;
using camvox_interfaces::msg::FrameImage;
using camvox_interfaces::msg::Keyframe;
using camvox_interfaces::msg::Scan;
using Bytes = std::vector<std::uint8_t>;

/// Reads from a buffer of exactly that size, so that a sanitizer sees any access beyond it.
template <typename T>
bool reads(const Bytes& cdr, T& message) {
  const std::unique_ptr<std::uint8_t[]> exact(new std::uint8_t[cdr.size()]);
  std::copy(cdr.begin(), cdr.end(), exact.get());
  return message_type<T>().read_cdr(exact.get(), cdr.size(), &message);
}

template <typename T>
void expect_round_trip(T& message) {
  const auto& type = message_type<T>();
  const Bytes cdr = type.to_cdr(&message);
  ASSERT_EQ(cdr.size(), type.cdr_size(&message));
  auto copy = test::unclean_message<T>();
  ASSERT_TRUE(reads(cdr, *copy));
  EXPECT_EQ(test::used_bytes(message), test::used_bytes(*copy));
  EXPECT_EQ(walk_schema(type.schema, cdr), "");
}

template <typename T>
class PlainCdr : public ::testing::Test {};
TYPED_TEST_SUITE(PlainCdr, test::PlainTypes);

TYPED_TEST(PlainCdr, RoundTripsRandomMessages) {
  std::mt19937 random(3);
  for (int round = 0; round < 100; ++round) {
    auto message = test::random_message<TypeParam>(random, 1U << (round % 8));
    expect_round_trip(*message);
  }
}

TYPED_TEST(PlainCdr, RoundTripsEmptyAndFull) {
  std::mt19937 random(4);
  expect_round_trip(*test::full_message<TypeParam>(random, 0));
  expect_round_trip(*test::full_message<TypeParam>(random, ~std::uint32_t{0}));
}

TYPED_TEST(PlainCdr, TouchesOnlyTheUsedPartWhenReading) {
  std::mt19937 random(5);
  auto source = test::random_message<TypeParam>(random, 20);
  auto target = test::unclean_message<TypeParam>();
  ASSERT_TRUE(reads(message_type<TypeParam>().to_cdr(source.get()), *target));
  EXPECT_EQ(std::memcmp(source.get(), target.get(), sizeof(TypeParam)), 0);
}

TYPED_TEST(PlainCdr, RefusesEveryTruncation) {
  std::mt19937 random(6);
  auto message = test::full_message<TypeParam>(random, 3);
  const Bytes cdr = message_type<TypeParam>().to_cdr(message.get());
  auto target = test::unclean_message<TypeParam>();
  for (std::size_t size = 0; size < cdr.size(); ++size) {
    EXPECT_FALSE(reads(Bytes(cdr.begin(), cdr.begin() + static_cast<long>(size)), *target)) << size;
    ASSERT_TRUE(message_type<TypeParam>().counters_valid(target.get())) << size;
  }
}

TYPED_TEST(PlainCdr, RefusesWrongEncapsulation) {
  std::mt19937 random(7);
  auto message = test::full_message<TypeParam>(random, 1);
  Bytes cdr = message_type<TypeParam>().to_cdr(message.get());
  for (const auto& [first, second] : {std::pair{0, 0}, {0, 2}, {0, 3}, {0, 7}, {1, 1}, {255, 1}}) {
    cdr[0] = static_cast<std::uint8_t>(first);
    cdr[1] = static_cast<std::uint8_t>(second);
    EXPECT_FALSE(reads(cdr, *message)) << first << " " << second;
  }
}

TYPED_TEST(PlainCdr, SurvivesRandomDamage) {
  std::mt19937 random(8);
  auto message = test::full_message<TypeParam>(random, 2);
  const Bytes good = message_type<TypeParam>().to_cdr(message.get());
  auto target = test::unclean_message<TypeParam>();
  for (int round = 0; round < 2000; ++round) {
    Bytes cdr = good;
    const std::size_t place = random() % cdr.size();
    for (std::size_t i = place; i < std::min(place + 4, cdr.size()); ++i) {
      cdr[i] = static_cast<std::uint8_t>(random());
    }
    cdr.resize(random() % 2 == 0 ? cdr.size() : random() % (cdr.size() + 1));
    (void)reads(cdr, *target);
    ASSERT_TRUE(message_type<TypeParam>().counters_valid(target.get()));
  }
}

TYPED_TEST(PlainCdr, WriteRefusesShortBuffers) {
  std::mt19937 random(9);
  const auto& type = message_type<TypeParam>();
  auto message = test::full_message<TypeParam>(random, 2);
  const std::size_t needed = type.cdr_size(message.get());
  for (const std::size_t size : {std::size_t{0}, std::size_t{3}, needed / 2, needed - 1}) {
    const std::unique_ptr<std::uint8_t[]> exact(new std::uint8_t[size]);
    EXPECT_EQ(type.write_cdr(message.get(), exact.get(), size), 0U);
  }
}

TEST(PlainCdrOfFrameImage, RefusesCountsOverCapacity) {
  auto image = test::unclean_message<FrameImage>();
  const auto& type = message_type<FrameImage>();
  const auto capacity = static_cast<std::uint32_t>(image->data().size());
  image->data_count() = capacity;
  Bytes cdr = type.to_cdr(image.get());
  ASSERT_TRUE(reads(cdr, *image));
  const std::uint32_t more = capacity + 1;
  std::memcpy(cdr.data() + cdr.size() - capacity - 4, &more, sizeof(more));
  cdr.push_back(0);
  EXPECT_FALSE(reads(cdr, *image)) << "one octet too many, all of them there";
  image->data_count() = more;
  EXPECT_FALSE(type.counters_valid(image.get()));
  EXPECT_TRUE(type.to_cdr(image.get()).empty());
  std::vector<std::uint8_t> room(cdr.size() + 8);
  EXPECT_EQ(type.write_cdr(image.get(), room.data(), room.size()), 0U);
}

TEST(PlainCdrOfCloud, RefusesIncompleteRowsAndAbsurdLengths) {
  auto cloud = test::unclean_message<Cloud>();
  const auto& type = message_type<Cloud>();
  Bytes cdr = type.to_cdr(cloud.get());  // no points: ends with the length of the sequence
  const auto with_length = [&](std::uint32_t floats, std::size_t present) {
    Bytes changed = cdr;
    std::memcpy(changed.data() + changed.size() - 4, &floats, sizeof(floats));
    changed.resize(changed.size() + present * sizeof(float));
    return changed;
  };
  EXPECT_TRUE(reads(with_length(8, 8), *cloud));
  EXPECT_EQ(cloud->points_count(), 2U);
  for (const std::uint32_t floats : {1U, 2U, 3U, 5U, 7U}) {
    EXPECT_FALSE(reads(with_length(floats, 8), *cloud)) << floats;
  }
  EXPECT_FALSE(reads(with_length(12, 8), *cloud));
  EXPECT_FALSE(reads(with_length(0x40000000U, 8), *cloud)) << "bytes wrap around in 32 bits";
  EXPECT_FALSE(reads(with_length(0xFFFFFFFCU, 8), *cloud));
}

// The same bytes from Fast CDR, with the ROS 2 schema's sequences written by hand.

class HandWritten {
 public:
  HandWritten() { cdr_.serialize_encapsulation(); }
  template <typename T>
  HandWritten& operator<<(const T& value) {
    cdr_ << value;
    return *this;
  }
  /// The first `count` rows of an array as one sequence.
  template <typename Array>
  HandWritten& sequence(const Array& array, std::uint32_t count) {
    using Element = typename test::ElementOf<Array>::type;
    const auto* first = reinterpret_cast<const Element*>(array.data());
    cdr_ << std::vector<Element>(first, first + count * sizeof(array[0]) / sizeof(Element));
    return *this;
  }
  [[nodiscard]] Bytes bytes() const {
    const auto* data = reinterpret_cast<const std::uint8_t*>(buffer_.getBuffer());
    return {data, data + cdr_.getSerializedDataLength()};
  }

 private:
  std::vector<char> zeros_ = std::vector<char>(std::size_t{64} << 10);  // it leaves gaps unwritten
  eprosima::fastcdr::FastBuffer buffer_{zeros_.data(), zeros_.size()};
  eprosima::fastcdr::Cdr cdr_{
      buffer_, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR};
};

TEST(PlainCdrBytes, OfKeyframeEqualFastCdrs) {
  std::mt19937 random(10);
  for (int round = 0; round < 20; ++round) {
    auto k = test::random_message<Keyframe>(random, 5);
    HandWritten expected;
    expected << k->header().stamp_ns() << k->header().frame_id() << k->id() << k->map_epoch()
             << k->parent_keyframe_id() << k->T_map_camera() << k->T_parent_camera()
             << k->covariance_camera() << k->padding();
    expected.sequence(k->landmark_ids(), k->landmark_ids_count())
        .sequence(k->features(), k->features_count())
        .sequence(k->depth(), k->depth_count())
        .sequence(k->octaves(), k->octaves_count())
        .sequence(k->descriptors(), k->descriptors_count());
    EXPECT_EQ(message_type<Keyframe>().to_cdr(k.get()), expected.bytes());
  }
}

TEST(PlainCdrBytes, OfScanEqualFastCdrs) {
  std::mt19937 random(11);
  for (int round = 0; round < 20; ++round) {
    auto s = test::random_message<Scan>(random, 5);
    HandWritten expected;
    expected << s->header().stamp_ns() << s->header().frame_id() << s->image_stamp_ns()
             << s->padding();
    expected.sequence(s->imu_stamp_ns(), s->imu_stamp_ns_count())
        .sequence(s->imu(), s->imu_count())
        .sequence(s->points(), s->points_count())
        .sequence(s->point_offset_ns(), s->point_offset_ns_count())
        .sequence(s->point_line(), s->point_line_count());
    expected << s->stationary() << s->padding_end();
    EXPECT_EQ(message_type<Scan>().to_cdr(s.get()), expected.bytes());
  }
}

}  // namespace
}  // namespace camvox::interfaces
