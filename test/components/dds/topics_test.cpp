#include <gtest/gtest.h>

#include "camvox/dds/component_context.hpp"

namespace camvox::dds {
namespace {

DiscoveredEndpoint endpoint(const std::string& topic, bool is_writer, bool reliable, bool latched) {
  return {.topic_name = topic,
          .type_name = "tf2_msgs::msg::dds_::TFMessage_",
          .guid = {},
          .is_writer = is_writer,
          .reliable = reliable,
          .latched = latched,
          .participant_name = {}};
}

TEST(Topics, AreSortedByNameWithWhoPublishesAndReadsThem) {
  const auto topics = topics_of({endpoint("rt/tf", false, true, false),
                                 endpoint("rt/a", true, true, false),
                                 endpoint("rt/tf", true, true, false),
                                 endpoint("rq/tf/setRequest", true, true, false)});
  ASSERT_EQ(topics.size(), 2U);
  EXPECT_EQ(topics[0].name, "/a");
  EXPECT_EQ(topics[1].name, "/tf");
  EXPECT_EQ(topics[1].type_name, "tf2_msgs/msg/TFMessage");
  EXPECT_EQ(topics[1].publishers.size(), 1U);
  EXPECT_EQ(topics[1].subscribers.size(), 1U);
  EXPECT_TRUE(topics_of({}).empty());
}

TEST(Topics, HaveTheTypeOfTheirPublishers) {
  auto reader = endpoint("rt/tf", false, true, false);
  reader.type_name = "std_msgs::msg::dds_::Header_";
  const auto writer = endpoint("rt/tf", true, true, false);
  EXPECT_EQ(topics_of({reader, writer}).at(0).type_name, "tf2_msgs/msg/TFMessage");
  EXPECT_EQ(topics_of({writer, reader}).at(0).type_name, "tf2_msgs/msg/TFMessage");
  EXPECT_EQ(topics_of({reader}).at(0).type_name, "std_msgs/msg/Header");
}

/// DDS matches no reader that asks for more than a writer offers: one that reads what is offered
/// must get the messages of each publisher.
TEST(Topics, OfferWhatAllTheirPublishersOffer) {
  const auto offered = [](const std::vector<DiscoveredEndpoint>& endpoints) {
    return describe(topics_of(endpoints).at(0)).offered;
  };
  const auto latched = endpoint("rt/tf", true, true, true);
  const auto best_effort = endpoint("rt/tf", true, false, true);
  const auto plain = endpoint("rt/tf", true, true, false);
  const auto reader = endpoint("rt/tf", false, false, false);
  EXPECT_TRUE(offered({latched, latched, reader}).latched);
  EXPECT_FALSE(offered({latched, plain}).latched);
  EXPECT_TRUE(offered({latched, plain}).reliable);
  EXPECT_FALSE(offered({latched, best_effort}).reliable);
  EXPECT_EQ(offered({reader}), qos::kDefault);  // nobody publishes
}

}  // namespace
}  // namespace camvox::dds
