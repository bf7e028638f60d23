#include <gtest/gtest.h>

#include <random>

#include "camvox/test/plain_messages.hpp"
#include "camvox/test/plain_type_list.hpp"

namespace camvox::interfaces {
namespace {

template <typename T>
class PlainLayoutTest : public ::testing::Test {};
TYPED_TEST_SUITE(PlainLayoutTest, test::PlainTypes);

TYPED_TEST(PlainLayoutTest, CppLayoutIsCdrLayout) {
  EXPECT_EQ(sizeof(TypeParam), TypeParam::getMaxCdrSerializedSize());
  EXPECT_EQ(message_type<TypeParam>().size, sizeof(TypeParam));
  EXPECT_TRUE(message_type<TypeParam>().plain);
}

// The generated structs have a vtable-free, pointer-free layout; loans depend on it.
TYPED_TEST(PlainLayoutTest, HasStandardLayout) {
  EXPECT_TRUE(std::is_standard_layout_v<TypeParam>);
}

/// Sums the bytes of all members, lists at full capacity with their counters.
struct MemberBytes {
  std::size_t bytes = 0;
  template <typename Member>
  void fixed(Member&) {
    bytes += sizeof(Member);
  }
  template <typename Array>
  void list(Array&, std::uint32_t&) {
    bytes += sizeof(Array) + sizeof(std::uint32_t);
  }
};

TYPED_TEST(PlainLayoutTest, VisitReachesEveryByteOnce) {
  MemberBytes members;
  PlainLayout<TypeParam>::visit(*std::make_unique<TypeParam>(), members);
  EXPECT_EQ(members.bytes, sizeof(TypeParam));
}

TYPED_TEST(PlainLayoutTest, ResetClearsAllButRows) {
  std::mt19937 random(1);
  auto message = test::random_message<TypeParam>(random, 8);
  message_type<TypeParam>().reset(message.get());
  for (const auto byte : test::used_bytes(*message)) ASSERT_EQ(byte, 0);
}

TYPED_TEST(PlainLayoutTest, CopyTakesTheUsedPartAndNothingElse) {
  const auto& type = message_type<TypeParam>();
  std::mt19937 random(2);
  for (int round = 0; round < 20; ++round) {
    auto source = test::random_message<TypeParam>(random, 50);
    auto target = test::unclean_message<TypeParam>();
    type.copy(source.get(), target.get());
    EXPECT_EQ(test::used_bytes(*source), test::used_bytes(*target));
    EXPECT_EQ(std::memcmp(source.get(), target.get(), sizeof(TypeParam)), 0)
        << "both have the same junk outside of the used part";
  }
}

TEST(PlainTypes, TheListOfThisTestIsComplete) {
  std::size_t plain = 0;
  for (const MessageType* type : all_message_types()) plain += type->plain ? 1 : 0;
  EXPECT_EQ(plain, test::kPlainTypeCount);
}

}  // namespace
}  // namespace camvox::interfaces
