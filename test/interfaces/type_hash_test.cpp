#include <gtest/gtest.h>

#include <map>
#include <string>

#include "camvox/interfaces/message_type.hpp"

namespace camvox::interfaces {
namespace {

// Published by ROS 2 Jazzy (rosidl_generator_type_description); the hash covers names, order and
// types of all fields, nested ones too, so an error in any copied .msg shows here.
const std::map<std::string, std::string> kPublished = {
    {"builtin_interfaces/msg/Time",
     "RIHS01_b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197"},
    {"builtin_interfaces/msg/Duration",
     "RIHS01_e8d009f659816f758b75334ee1a9ca5b5c0b859843261f14c7f937349599d93b"},
    {"std_msgs/msg/Header",
     "RIHS01_f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01"},
    {"sensor_msgs/msg/Image",
     "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
    {"sensor_msgs/msg/CompressedImage",
     "RIHS01_15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a"},
    {"sensor_msgs/msg/CameraInfo",
     "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"},
    {"sensor_msgs/msg/PointField",
     "RIHS01_5c6a4750728c2bcfbbf7037225b20b02d4429634732146b742dee1726637ef01"},
    {"sensor_msgs/msg/Imu",
     "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"},
    {"sensor_msgs/msg/NavSatFix",
     "RIHS01_62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404"},
    {"nav_msgs/msg/Odometry",
     "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
    {"nav_msgs/msg/Path",
     "RIHS01_1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b"},
    {"geometry_msgs/msg/PoseStamped",
     "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"},
    {"geometry_msgs/msg/PoseWithCovarianceStamped",
     "RIHS01_26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e"},
    {"geometry_msgs/msg/TransformStamped",
     "RIHS01_0a241f87d04668d94099cbb5ba11691d5ad32c2f29682e4eb5653424bd275206"},
    {"geometry_msgs/msg/TwistStamped",
     "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64"},
    {"tf2_msgs/msg/TFMessage",
     "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
    {"rosgraph_msgs/msg/Clock",
     "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"},
    {"diagnostic_msgs/msg/DiagnosticArray",
     "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"},
    {"livox_ros_driver2/msg/CustomMsg",
     "RIHS01_2eb17e5e35bf5a2d6cd079f3c57f33abf95e5bf7d71b42cddc05daace73d815a"},
    {"livox_ros_driver2/msg/CustomPoint",
     "RIHS01_3289ac5e30c215e055e9b48fe0df5c2fb916abbb0c3a75315071bb7d735067f5"},
    {"composition_interfaces/srv/LoadNode_Request",
     "RIHS01_7d3496175f54f92d652547e144c9b2a3b22afd604f84ed70adfcd1cfe35801b5"},
    {"composition_interfaces/srv/LoadNode_Response",
     "RIHS01_08cdf942efabec2448fd03c131f3627a33ed05376400612425f871feb87ca9fd"},
    {"composition_interfaces/srv/UnloadNode_Request",
     "RIHS01_95d5cfc357956740190c7685ac868d9c7c98dcb8c1416aae8eaa351422074e12"},
    {"composition_interfaces/srv/UnloadNode_Response",
     "RIHS01_fa7fc38f9206220a6bc1558a3c019269e5aa592f7fae01dffbd19f56eb86d599"},
    {"composition_interfaces/srv/ListNodes_Request",
     "RIHS01_57c879a1825b3fa15fd58e70d2e73223af6b9c45c7ae104cc107e73464d3a724"},
    {"composition_interfaces/srv/ListNodes_Response",
     "RIHS01_b7cd8401aedcd85c4cedce384944001d5c1ab611e0164a8207045cfcaf4a2584"},
    {"std_srvs/srv/Trigger_Request",
     "RIHS01_d010825374ce8918e72bfd826c82603e60f45419e932ea976f807b74a863a199"},
    {"std_srvs/srv/Trigger_Response",
     "RIHS01_2d946c21e2fc3f1e9ca6986a8191d85fcc70097a8bb7771a053564bc47009cdf"},
    {"rcl_interfaces/srv/GetParameters_Request",
     "RIHS01_135a9e1c3d7cebef792f6687d7ddf99949b21a0bd9a320d863a9110a3f5cf4d6"},
    {"rcl_interfaces/srv/GetParameters_Response",
     "RIHS01_9fa773b46e39cc5d02db6224d8fd520bb9caeeffc2b27c96c1e59431baba9f2a"},
    {"rcl_interfaces/srv/SetParameters_Request",
     "RIHS01_130d46386b7e84ea9ecf60608a4d83cbe5e5cb7c6cc5b712b7a4e3a6c254e932"},
    {"rcl_interfaces/srv/SetParameters_Response",
     "RIHS01_7a0e8140a0b8d98308fa81a5403a766e610af29a239caf54b7553227906fc266"},
    {"rcl_interfaces/srv/ListParameters_Request",
     "RIHS01_a1b0b5d6b967a5b8ac5bc8563c3ea678f349e312a6a4967227c5a96bc5ce38df"},
    {"rcl_interfaces/srv/ListParameters_Response",
     "RIHS01_31b937b82de3612426be79f231e386259f97e8dc843e3f2845288b4bfa296bdd"},
};

TEST(TypeHash, EqualsThePublishedOnes) {
  for (const auto& [name, hash] : kPublished) {
    const MessageType* type = find_message_type(name);
    ASSERT_NE(type, nullptr) << name;
    EXPECT_EQ(type->type_hash, hash) << name;
  }
}

TEST(TypeHash, OfPlainTypesIsOwnAndDiffersFromEveryOther) {
  std::map<std::string, std::string> name_of_hash;
  for (const MessageType* type : all_message_types()) {
    EXPECT_EQ(type->type_hash.size(), std::string("RIHS01_").size() + 64) << type->ros_name;
    const auto [other, is_new] = name_of_hash.emplace(type->type_hash, type->ros_name);
    EXPECT_TRUE(is_new) << type->ros_name << " and " << other->second;
  }
  EXPECT_GT(name_of_hash.size(), kPublished.size());
}

}  // namespace
}  // namespace camvox::interfaces
