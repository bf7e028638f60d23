#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <string_view>
#include <vector>

#include "camvox/mapping/map.hpp"
#include "camvox/storage/byte_buffer.hpp"
#include "camvox/storage/status.hpp"
#include "camvox/tracking/tracker_config.hpp"

/// The messages of a map file: their schemas, and how they are written and read.
namespace camvox::mapping::map_file {

struct MessageKind {
  std::string_view topic;
  std::string_view type;
  std::string_view schema;  ///< As `ros2msg` has it.
};
extern const MessageKind kHeader;
extern const MessageKind kKeyframe;
extern const MessageKind kLandmarks;
extern const MessageKind kLoopEnds;  ///< Since version 2.

/// First message of a file.
struct Header {
  std::uint32_t version = 0;
  std::uint64_t epoch = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t landmarks = 0;
  tracking::TrackingCamera camera;
};

struct SavedKeyframe {
  tracking::Keyframe frame;  ///< Without what its features show: the landmarks know.
  KeyframeId parent = 0;     ///< In the spanning tree.
};

void encode(const Header& header, storage::ByteBuffer& out);
void encode(const MapKeyframe& keyframe, storage::ByteBuffer& out);
void encode(std::span<const MapLandmark* const> landmarks, storage::ByteBuffer& out);
void encode(const std::set<KeyframeId>& loop_ends, storage::ByteBuffer& out);

/// A header of a version that is not known has only its version.
storage::Result<Header> decode_header(storage::Bytes message);
storage::Result<SavedKeyframe> decode_keyframe(storage::Bytes message);
/// Every landmark has an observation, by keyframes in ascending order.
storage::Result<std::vector<MapLandmark>> decode_landmarks(storage::Bytes message);
storage::Result<std::set<KeyframeId>> decode_loop_ends(storage::Bytes message);

}  // namespace camvox::mapping::map_file
