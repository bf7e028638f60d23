#pragma once

#include "camvox/import/import_report.hpp"

namespace camvox::import {

/// Imports a ROS 1 bag, format 2.0 (wiki.ros.org/Bags/Format/2.0), with chunks that are plain, bz2
/// or lz4. Messages become CDR by the definition that the bag carries, if this package has a type
/// of the same name whose fields are the same but for `seq` of Header, which ROS 2 does not have.
/// livox_ros_driver/CustomMsg becomes livox_ros_driver2/msg/CustomMsg; a variant without `tag` gets
/// tag 0. tf/tfMessage becomes tf2_msgs/msg/TFMessage. All other topics are left out, with reasons.
/// Values stay as they are (Livox's drivers give acceleration in g); log times are those of the
/// bag.
storage::Result<ImportReport> import_rosbag1(const std::filesystem::path& file,
                                             const ImportOptions& options);

}  // namespace camvox::import
