#include "camvox/import/rosbag1.hpp"

#include <optional>

#include "import_job.hpp"
#include "ros1_conversion.hpp"
#include "rosbag1_reader.hpp"

namespace camvox::import {
namespace {

/// The ROS 2 name of a ROS 1 type: "sensor_msgs/Imu" -> "sensor_msgs/msg/Imu".
std::string ros2_name(const std::string& ros1_type) {
  if (ros1_type == "tf/tfMessage") return "tf2_msgs/msg/TFMessage";
  if (ros1_type == "livox_ros_driver/CustomMsg" || ros1_type == "livox_interfaces/CustomMsg") {
    return "livox_ros_driver2/msg/CustomMsg";
  }
  return storage::full_type_name(ros1_type);
}

/// What becomes of the messages of a connection: a topic, or the reason why they are left out.
struct Route {
  std::string topic;
  const interfaces::MessageType* type = nullptr;
  std::optional<Ros1Conversion> conversion;
  std::string why_not;
  std::uint64_t left_out = 0;
  std::uint64_t malformed = 0;
};

class Rosbag1Import {
 public:
  Rosbag1Import(const std::filesystem::path& file, const ImportOptions& options)
      : reader_(file), job_(options, name_from(file, ".bag")) {}

  ImportReport run() {
    while (const auto* message = reader_.next()) {
      job_.progress(reader_.position(), reader_.size());
      write(*message, route_of(*message->connection));
    }
    job_.progress(reader_.size(), reader_.size());
    describe();
    return job_.finish();
  }

 private:
  Route& route_of(const Rosbag1Connection& connection) {
    const auto [entry, is_new] = routes_.try_emplace(connection.id);
    if (is_new) {
      names_[connection.id] = connection.topic + " (" + connection.type + ")";
      try {
        open(connection, entry->second);
      } catch (const ImportError& error) {
        entry->second.why_not = error.what();
      }
    }
    return entry->second;
  }

  void open(const Rosbag1Connection& connection, Route& route) {
    route.topic = connection.topic.starts_with('/') ? connection.topic : "/" + connection.topic;
    const auto* type = interfaces::find_message_type(ros2_name(connection.type));
    if (type == nullptr || type->plain) {
      route.why_not = "camvox has no such type";
      return;
    }
    const auto schema = storage::MessageSchema::parse(type->ros_name, std::string(type->schema));
    if (!schema.ok()) throw std::logic_error(schema.status().message());
    route.conversion.emplace(connection.type, connection.definition, *schema);
    const bool latched = connection.latching || route.topic == "/tf_static";
    require(job_.writer().add_topic(
        route.topic,
        *type,
        latched ? interfaces::qos::kStaticTransformsWriter : interfaces::qos::kDefault));
    route.type = type;
  }

  void write(const Rosbag1Message& message, Route& route) {
    if (route.type == nullptr) {
      ++route.left_out;
    } else if (!route.conversion->convert(message.data, cdr_)) {
      ++route.malformed;
    } else {
      require(job_.writer().write_cdr(route.topic, message.time_ns, *route.type, cdr_));
    }
  }

  void describe() {
    for (const auto& [id, route] : routes_) {
      if (route.left_out > 0) {
        job_.report.left_out.push_back({names_[id], route.left_out, route.why_not});
      }
      if (route.malformed > 0) {
        job_.report.left_out.push_back(
            {names_[id], route.malformed, "the messages do not fit their own definition"});
      }
    }
    if (!reader_.closed()) {
      job_.report.notes.emplace_back("the recorder did not close the bag; it was read to its end");
    }
  }

  Rosbag1Reader reader_;
  ImportJob job_;
  std::map<std::uint32_t, Route> routes_;  ///< By connection.
  std::map<std::uint32_t, std::string> names_;
  std::vector<std::uint8_t> cdr_;
};

}  // namespace

storage::Result<ImportReport> import_rosbag1(const std::filesystem::path& file,
                                             const ImportOptions& options) {
  return guarded([&] { return Rosbag1Import(file, options).run(); });
}

}  // namespace camvox::import
