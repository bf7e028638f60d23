#include "camvox/storage/bag_metadata.hpp"

#include <yaml-cpp/yaml.h>

#include <array>
#include <sstream>

#include "camvox/storage/sink.hpp"
#include "camvox/storage/source.hpp"
#include "camvox/storage/yaml_text.hpp"

namespace camvox::storage {
namespace {

constexpr const char* kTopKey = "rosbag2_bagfile_information";
constexpr const char* kFileName = "metadata.yaml";
constexpr std::uint64_t kMaxYamlSize = 64ULL << 20;

std::string times_text(const std::string& indent,
                       const char* start_key,
                       std::int64_t start_ns,
                       std::int64_t duration_ns) {
  return indent + start_key + ":\n" + indent +
         "  nanoseconds_since_epoch: " + std::to_string(start_ns) + "\n" + indent + "duration:\n" +
         indent + "  nanoseconds: " + std::to_string(duration_ns) + "\n";
}

std::string topic_text(const BagTopicMetadata& topic, int version) {
  std::string text = "  - topic_metadata:\n      name: " + yaml_string(topic.name) +
                     "\n      type: " + yaml_string(topic.type) +
                     "\n      serialization_format: " + yaml_string(topic.serialization_format) +
                     "\n      offered_qos_profiles: " + yaml_quoted(topic.offered_qos_profiles) +
                     "\n";
  if (version >= 7) {
    text += "      type_description_hash: " + yaml_string(topic.type_description_hash) + "\n";
  }
  return text + "    message_count: " + std::to_string(topic.message_count) + "\n";
}

std::string files_text(const BagMetadata& metadata) {
  std::string paths = "relative_file_paths:\n";
  std::string files = "files:\n";
  for (const auto& file : metadata.files) {
    paths += "  - " + yaml_string(file.path) + "\n";
    files += "  - path: " + yaml_string(file.path) + "\n" +
             times_text("    ", "starting_time", file.starting_time_ns, file.duration_ns) +
             "    message_count: " + std::to_string(file.message_count) + "\n";
  }
  if (metadata.files.empty()) return "relative_file_paths: []\nfiles: []\n";
  return metadata.version >= 5 ? paths + files : paths;
}

std::string custom_text(const BagMetadata& metadata) {
  std::string text = metadata.custom_data.empty() ? "custom_data: ~\n" : "custom_data:\n";
  for (const auto& [key, value] : metadata.custom_data) {
    text += "  " + yaml_string(key) + ": " + yaml_string(value) + "\n";
  }
  return text;
}

template <typename T>
void read(const YAML::Node& node, const char* key, T& value) {
  if (const auto child = node[key]; child && !child.IsNull()) value = child.as<T>();
}

template <typename T>
void read(const YAML::Node& node, const char* key, const char* inner, T& value) {
  if (const auto child = node[key]; child && child.IsMap()) read(child, inner, value);
}

BagTopicMetadata read_topic(const YAML::Node& node) {
  BagTopicMetadata topic;
  const auto details = node["topic_metadata"];
  if (!details || !details.IsMap()) throw YAML::Exception(node.Mark(), "no topic_metadata");
  read(details, "name", topic.name);
  read(details, "type", topic.type);
  read(details, "serialization_format", topic.serialization_format);
  read(details, "type_description_hash", topic.type_description_hash);
  read(node, "message_count", topic.message_count);
  const auto qos = details["offered_qos_profiles"];
  if (qos && qos.IsScalar()) {
    topic.offered_qos_profiles = qos.as<std::string>();
  } else if (qos && qos.IsSequence() && qos.size() > 0) {
    topic.offered_qos_profiles = YAML::Dump(qos);  // version 9: a list, not a text
  }
  return topic;
}

BagFileMetadata read_file(const YAML::Node& node) {
  BagFileMetadata file;
  read(node, "path", file.path);
  read(node, "starting_time", "nanoseconds_since_epoch", file.starting_time_ns);
  read(node, "duration", "nanoseconds", file.duration_ns);
  read(node, "message_count", file.message_count);
  return file;
}

BagMetadata read_metadata(const YAML::Node& root) {
  const YAML::Node node = root[kTopKey] ? root[kTopKey] : root;
  BagMetadata metadata;
  if (!node["version"]) throw YAML::Exception(node.Mark(), "no version");
  read(node, "version", metadata.version);
  read(node, "storage_identifier", metadata.storage_identifier);
  read(node, "duration", "nanoseconds", metadata.duration_ns);
  read(node, "starting_time", "nanoseconds_since_epoch", metadata.starting_time_ns);
  read(node, "message_count", metadata.message_count);
  for (const auto& topic : node["topics_with_message_count"]) {
    metadata.topics.push_back(read_topic(topic));
  }
  read(node, "compression_format", metadata.compression_format);
  read(node, "compression_mode", metadata.compression_mode);
  for (const auto& file : node["files"]) metadata.files.push_back(read_file(file));
  if (metadata.files.empty()) {
    for (const auto& path : node["relative_file_paths"]) {
      metadata.files.push_back({path.as<std::string>(), 0, 0, 0});
    }
  }
  read(node, "custom_data", metadata.custom_data);
  read(node, "ros_distro", metadata.ros_distro);
  return metadata;
}

}  // namespace

std::string to_yaml(const BagMetadata& metadata) {
  std::string text =
      "version: " + std::to_string(metadata.version) +
      "\nstorage_identifier: " + yaml_string(metadata.storage_identifier) +
      "\nduration:\n  nanoseconds: " + std::to_string(metadata.duration_ns) +
      "\nstarting_time:\n  nanoseconds_since_epoch: " + std::to_string(metadata.starting_time_ns) +
      "\nmessage_count: " + std::to_string(metadata.message_count) +
      "\ntopics_with_message_count:" + (metadata.topics.empty() ? " []\n" : "\n");
  for (const auto& topic : metadata.topics) text += topic_text(topic, metadata.version);
  text += "compression_format: " + yaml_quoted(metadata.compression_format) +
          "\ncompression_mode: " + yaml_quoted(metadata.compression_mode) + "\n" +
          files_text(metadata);
  if (metadata.version >= 6) text += custom_text(metadata);
  if (metadata.version >= 8) text += "ros_distro: " + yaml_quoted(metadata.ros_distro);
  return text;
}

Result<BagMetadata> parse_bag_metadata(const std::string& yaml) {
  try {
    const YAML::Node root = YAML::Load(yaml);
    if (!root.IsMap()) return Status(StatusCode::kCorrupt, "bag metadata are not a YAML map");
    return read_metadata(root);
  } catch (const YAML::Exception& error) {
    return Status(StatusCode::kCorrupt,
                  std::string("bag metadata cannot be read: ") + error.what());
  }
}

Status write_bag_metadata(const std::filesystem::path& folder, const BagMetadata& metadata) {
  std::string text = std::string(kTopKey) + ":\n";
  std::istringstream lines(to_yaml(metadata));
  for (std::string line; std::getline(lines, line);) text += "  " + line + "\n";
  const auto aside = folder / (std::string(".") + kFileName + ".new");
  auto sink = FileSink::create(aside);
  if (!sink.ok()) return sink.status();
  const std::array parts = {as_bytes(text)};
  Status status = (*sink)->write(parts);
  if (status.ok()) status = (*sink)->close();
  std::error_code error;
  if (status.ok()) std::filesystem::rename(aside, folder / kFileName, error);
  if (error) return {StatusCode::kIo, (folder / kFileName).string() + ": " + error.message()};
  return status;
}

Result<BagMetadata> read_bag_metadata(const std::filesystem::path& folder) {
  const auto path = folder / kFileName;
  const auto source = FileSource::open(path);
  if (!source.ok()) return source.status();
  if ((*source)->size() > kMaxYamlSize) {
    return Status(StatusCode::kLimit, path.string() + ": is too large for bag metadata");
  }
  ByteBuffer buffer;
  const auto bytes = (*source)->view(0, (*source)->size(), buffer);
  if (!bytes.ok()) return bytes.status();
  auto metadata = parse_bag_metadata(std::string(as_text(*bytes)));
  if (metadata.ok()) return metadata;
  return Status(metadata.status().code(), path.string() + ": " + metadata.status().message());
}

}  // namespace camvox::storage
