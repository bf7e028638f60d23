#include "camvox/mapping/map_file.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>

#include "camvox/storage/stream_reader.hpp"
#include "camvox/storage/writer.hpp"
#include "map_file_messages.hpp"

namespace camvox::mapping {
namespace {

using map_file::MessageKind;
using storage::Result;
using storage::Status;
using storage::StatusCode;

constexpr const char* kProfile = "camvox_map";
constexpr const char* kSchemaEncoding = "ros2msg";
constexpr std::size_t kLandmarksInMessage = 1024;
constexpr std::size_t kObservationsInMessage = 65536;
/// Of any record or chunk: what is written is far below.
constexpr std::uint64_t kMaxRecordSize = 64ULL << 20;
constexpr std::uint64_t kChunkSize = 4ULL << 20;
constexpr std::uint64_t kTreeNode = 48;

/// Puts messages into a file of ours.
class Writer {
 public:
  Writer() : mcap_(options()) {}

  Status open(const std::filesystem::path& path) {
    auto sink = storage::FileSink::create(path, storage::Durability::kPowerCut);
    if (!sink.ok()) return sink.status();
    return mcap_.open(std::move(*sink));
  }
  template <typename Content>
  Status write(const MessageKind& kind, std::int64_t stamp_ns, const Content& content) {
    auto schema =
        mcap_.add_schema(std::string(kind.type), kSchemaEncoding, std::string(kind.schema));
    if (!schema.ok()) return schema.status();
    auto channel = mcap_.add_channel(*schema, std::string(kind.topic), "cdr");
    if (!channel.ok()) return channel.status();
    map_file::encode(content, buffer_);
    const auto time_ns = static_cast<std::uint64_t>(std::max<std::int64_t>(stamp_ns, 0));
    return mcap_.write(storage::Message{*channel, sequence_++, time_ns, time_ns, buffer_.view()});
  }
  Status close() { return mcap_.close(); }

 private:
  static storage::McapWriterOptions options() {
    storage::McapWriterOptions options;
    options.profile = kProfile;
    options.chunk_size = kChunkSize;
    options.compression = storage::Compression::kZstd;
    return options;
  }

  storage::McapWriter mcap_;
  storage::ByteBuffer buffer_;
  std::uint32_t sequence_ = 0;
};

Status write_landmarks(const Map& map, std::int64_t stamp_ns, Writer& writer) {
  std::vector<const MapLandmark*> block;
  std::size_t observations = 0;
  const auto flush = [&]() -> Status {
    if (block.empty()) return {};
    const std::span<const MapLandmark* const> content(block);
    auto status = writer.write(map_file::kLandmarks, stamp_ns, content);
    block.clear();
    observations = 0;
    return status;
  };
  for (const auto id : map.landmark_ids()) {
    const auto& landmark = map.landmark(id);
    block.push_back(&landmark);
    observations += landmark.observations.size();
    if (block.size() < kLandmarksInMessage && observations < kObservationsInMessage) continue;
    if (auto status = flush(); !status.ok()) return status;
  }
  return flush();
}

Status write_map(const std::filesystem::path& path,
                 const Map& map,
                 std::uint64_t epoch,
                 const tracking::TrackingCamera& camera,
                 const std::set<KeyframeId>& loop_ends) {
  Writer writer;
  if (auto status = writer.open(path); !status.ok()) return status;
  std::int64_t first_ns = 0, last_ns = 0;
  if (!map.keyframes().empty()) {
    first_ns = map.keyframes().begin()->second.frame.stamp_ns;
    last_ns = map.keyframes().rbegin()->second.frame.stamp_ns;
  }
  const map_file::Header header{
      kMapFileVersion, epoch, map.keyframes().size(), map.landmark_count(), camera};
  if (auto status = writer.write(map_file::kHeader, first_ns, header); !status.ok()) return status;
  for (const auto id : map.parents_first()) {
    const auto& keyframe = map.keyframe(id);
    auto status = writer.write(map_file::kKeyframe, keyframe.frame.stamp_ns, keyframe);
    if (!status.ok()) return status;
  }
  if (auto status = write_landmarks(map, last_ns, writer); !status.ok()) return status;
  if (auto status = writer.write(map_file::kLoopEnds, last_ns, loop_ends); !status.ok()) {
    return status;
  }
  return writer.close();
}

/// Builds the map of a file message by message.
class Builder {
 public:
  Builder(const tracking::TrackingCamera& camera, const MapFileLimits& limits)
      : camera_(camera), limits_(limits), memory_left_(limits.memory_bytes) {}

  Status add(std::string_view type, storage::Bytes message) {
    if (type == map_file::kHeader.type) return add_header(message);
    if (header_.version == 0) return {StatusCode::kCorrupt, "the header is not the first message"};
    if (type == map_file::kKeyframe.type) return add_keyframe(message);
    if (type == map_file::kLandmarks.type) return add_landmarks(message);
    if (type == map_file::kLoopEnds.type) return add_loop_ends(message);
    return {StatusCode::kCorrupt, "a message of type " + std::string(type) + " in a map"};
  }

  Result<LoadedMap> finish() && {
    if (header_.version == 0) return Status(StatusCode::kCorrupt, "it has no header");
    const auto& map = loaded_.map;
    if (map.keyframes().size() != header_.keyframes || map.landmark_count() != header_.landmarks) {
      return Status(StatusCode::kCorrupt, "parts of it are missing");
    }
    try {
      map.check_consistency();
    } catch (const std::logic_error& error) {
      return Status(StatusCode::kCorrupt, error.what());
    }
    loaded_.epoch = header_.epoch;
    return std::move(loaded_);
  }

 private:
  Status add_header(storage::Bytes message) {
    if (header_.version != 0) return {StatusCode::kCorrupt, "a second header"};
    auto header = map_file::decode_header(message);
    if (!header.ok()) return header.status();
    if (header->version < 1 || header->version > kMapFileVersion) {
      return {StatusCode::kUnsupported,
              "a map of version " + std::to_string(header->version) +
                  "; this program reads versions 1 to " + std::to_string(kMapFileVersion)};
    }
    header_ = *header;
    if (header_.keyframes > limits_.keyframes) {
      return {StatusCode::kLimit,
              std::to_string(header_.keyframes) + " keyframes; at most " +
                  std::to_string(limits_.keyframes) + " are accepted"};
    }
    return same_camera();
  }

  Status same_camera() const {
    const auto& a = header_.camera;
    const auto& b = camera_;
    std::string differs;
    const auto compare = [&differs](const char* what, double in_file, double here) {
      if (in_file == here) return;
      differs += std::string(differs.empty() ? "" : ", ") + what + " " + std::to_string(in_file) +
                 " in the file, " + std::to_string(here) + " here";
    };
    compare("width_px", a.width_px, b.width_px);
    compare("height_px", a.height_px, b.height_px);
    compare("fx_px", a.pinhole.fx_px, b.pinhole.fx_px);
    compare("fy_px", a.pinhole.fy_px, b.pinhole.fy_px);
    compare("cx_px", a.pinhole.cx_px, b.pinhole.cx_px);
    compare("cy_px", a.pinhole.cy_px, b.pinhole.cy_px);
    compare("pyramid levels", a.scale.levels, b.scale.levels);
    compare("pyramid factor", a.scale.factor, b.scale.factor);
    if (differs.empty()) return {};
    return {StatusCode::kInvalid, "made with another camera: " + differs};
  }

  /// Takes memory from what the limits allow. `upper_bytes` may be more than is really taken; when
  /// that has used all up, what is left is counted anew.
  Status charge(std::uint64_t upper_bytes) {
    if (upper_bytes > memory_left_) {
      const std::uint64_t used = loaded_.map.memory_bytes();
      memory_left_ = used < limits_.memory_bytes ? limits_.memory_bytes - used : 0;
    }
    if (upper_bytes > memory_left_) {
      return {StatusCode::kLimit,
              "the map takes more than " + std::to_string(limits_.memory_bytes >> 20) + " MiB"};
    }
    memory_left_ -= upper_bytes;
    return {};
  }

  Status add_keyframe(storage::Bytes message) {
    constexpr std::uint64_t kBytes = sizeof(MapKeyframe) + 64 * 48 * 4;
    if (auto status = charge(kBytes + 2 * message.size()); !status.ok()) return status;
    auto saved = map_file::decode_keyframe(message);
    if (!saved.ok()) return saved.status();
    const auto& keyframes = loaded_.map.keyframes();
    const KeyframeId id = saved->frame.id;
    const auto who = "keyframe " + std::to_string(id);
    if (keyframes.size() >= header_.keyframes) {
      return {StatusCode::kCorrupt, "more keyframes than its header says"};
    }
    if (keyframes.contains(id)) return {StatusCode::kCorrupt, who + " comes twice"};
    const bool root = saved->parent == 0;
    if (root != keyframes.empty() || (!root && !keyframes.contains(saved->parent))) {
      return {StatusCode::kCorrupt, who + " comes before its parent, or is a second root"};
    }
    loaded_.map.add_keyframe(std::move(saved->frame), saved->parent);
    return {};
  }

  Status add_landmarks(storage::Bytes message) {
    auto landmarks = map_file::decode_landmarks(message);
    if (!landmarks.ok()) return landmarks.status();
    for (const auto& landmark : *landmarks) {
      if (auto status = add_landmark(landmark); !status.ok()) return status;
    }
    return {};
  }

  Status add_loop_ends(storage::Bytes message) {
    auto ends = map_file::decode_loop_ends(message);
    if (!ends.ok()) return ends.status();
    for (const auto id : *ends) {
      if (loaded_.map.find_keyframe(id) != nullptr) continue;
      return {StatusCode::kCorrupt,
              "a loop ends at keyframe " + std::to_string(id) + ", not there"};
    }
    loaded_.loop_ends = std::move(*ends);
    return {};
  }

  Status add_landmark(const MapLandmark& saved) {
    auto& map = loaded_.map;
    const auto id = saved.landmark.id;
    const auto who = "landmark " + std::to_string(id);
    const std::uint64_t seen_by = saved.observations.size();
    if (auto status = charge(sizeof(MapLandmark) + seen_by * seen_by * kTreeNode); !status.ok()) {
      return status;
    }
    if (map.find_landmark(id) != nullptr) return {StatusCode::kCorrupt, who + " comes twice"};
    for (const auto& seen : saved.observations) {
      const auto* keyframe = map.find_keyframe(seen.keyframe);
      if (keyframe == nullptr || seen.feature >= keyframe->frame.landmark_ids.size() ||
          keyframe->frame.landmark_ids[seen.feature] != 0) {
        return {StatusCode::kCorrupt,
                who + " is seen by a feature of keyframe " + std::to_string(seen.keyframe) +
                    " that is not there, or shows another one"};
      }
    }
    map.add_landmark(saved.landmark, saved.observations.front(), saved.born_at);
    map.set_counts(id, saved.visible, saved.found);
    for (std::size_t i = 1; i < saved.observations.size(); ++i) {
      map.observe(id, saved.observations[i]);
    }
    return {};
  }

  tracking::TrackingCamera camera_;
  MapFileLimits limits_;
  std::uint64_t memory_left_;
  map_file::Header header_;
  LoadedMap loaded_;
};

bool is_ours(const storage::Schema& schema) {
  return std::ranges::any_of(
      std::array{
          &map_file::kHeader, &map_file::kKeyframe, &map_file::kLandmarks, &map_file::kLoopEnds},
      [&schema](const MessageKind* kind) {
        return schema.name == kind->type && schema.encoding == kSchemaEncoding &&
               schema.data == kind->schema;
      });
}

Result<LoadedMap> read_map(const storage::Source& source, Builder builder) {
  storage::StreamReaderOptions options;
  options.limits.max_record_size = kMaxRecordSize;
  options.limits.max_chunk_size = kMaxRecordSize;
  storage::McapStreamReader reader(source, options);
  std::map<std::uint16_t, std::string> schemas;
  std::map<std::uint16_t, std::string> channels;  ///< Type by id.
  while (const auto* record = reader.next()) {
    if (const auto* header = std::get_if<storage::Header>(record)) {
      if (header->profile == kProfile) continue;
      return Status(StatusCode::kInvalid,
                    "an MCAP file, but not a map (its profile is '" + header->profile + "')");
    }
    if (const auto* schema = std::get_if<storage::Schema>(record)) {
      if (!is_ours(*schema)) {
        return Status(StatusCode::kUnsupported,
                      "its schema '" + schema->name + "' is not what this program writes");
      }
      schemas[schema->id] = schema->name;
    } else if (const auto* channel = std::get_if<storage::Channel>(record)) {
      channels[channel->id] = schemas[channel->schema_id];
    } else if (const auto* message = std::get_if<storage::Message>(record)) {
      auto status = builder.add(channels[message->channel_id], message->data);
      if (!status.ok()) return status;
    }
  }
  if (!reader.status().ok()) return reader.status();
  if (!reader.problems().empty()) return reader.problems().front().status;
  return std::move(builder).finish();
}

}  // namespace

Status save_map(const std::filesystem::path& path,
                const Map& map,
                std::uint64_t epoch,
                const tracking::TrackingCamera& camera,
                const std::set<KeyframeId>& loop_ends) {
  auto aside = path;
  aside += ".part";
  auto status = write_map(aside, map, epoch, camera, loop_ends);
  std::error_code error;
  if (status.ok()) std::filesystem::rename(aside, path, error);
  if (status.ok() && !error) return {};
  const auto why = error ? error.message() : status.message();
  std::filesystem::remove(aside, error);
  return {status.ok() ? StatusCode::kIo : status.code(),
          path.string() + ": the map cannot be saved: " + why};
}

Result<LoadedMap> load_map(const std::filesystem::path& path,
                           const tracking::TrackingCamera& camera,
                           const MapFileLimits& limits) {
  const auto source = storage::FileSource::open(path);
  auto loaded = source.ok() ? read_map(**source, Builder(camera, limits))
                            : Result<LoadedMap>(source.status());
  if (loaded.ok()) return loaded;
  const auto& status = loaded.status();
  const bool foreign = status.code() == StatusCode::kBadMagic;
  return Status(status.code(),
                path.string() + ": the map cannot be loaded: " +
                    (foreign ? "not an MCAP file" : status.message()));
}

}  // namespace camvox::mapping
