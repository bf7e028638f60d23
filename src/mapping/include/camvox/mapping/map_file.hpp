#pragma once

#include <cstdint>
#include <filesystem>
#include <set>

#include "camvox/mapping/map.hpp"
#include "camvox/storage/status.hpp"
#include "camvox/tracking/tracker_config.hpp"

/// A map as a file. The container is MCAP with the profile "camvox_map": chunks with checksums, any
/// MCAP tool lists and prints them. The content are CDR messages by `ros2msg` schemas: one header
/// (version, camera, counts), the keyframes, parents before their children, then the landmarks by
/// id with who sees them, then the ends of loops by surfaces (see Mapper::correct). Covisibility
/// and the lookup grids follow from these and are not stored.
namespace camvox::mapping {

/// Raised when a reader of the version before could not read what is written now. Earlier ones are
/// read: version 1 has no loop ends.
inline constexpr std::uint32_t kMapFileVersion = 2;

/// What a file may ask for. A map over the limits is refused before the memory is taken.
struct MapFileLimits {
  std::uint64_t keyframes = 65536;
  std::uint64_t memory_bytes = 8ULL << 30;  ///< Of the map, as Map::memory_bytes() counts it.
};

struct LoadedMap {
  Map map;
  std::uint64_t epoch = 0;
  std::set<KeyframeId> loop_ends;  ///< All in the map.
};

/// Writes the map aside, waits for the disk, and puts it in place of `path`: there is the old file
/// or the new one, never half of one. Same map, same bytes.
storage::Status save_map(const std::filesystem::path& path,
                         const Map& map,
                         std::uint64_t epoch,
                         const tracking::TrackingCamera& camera,
                         const std::set<KeyframeId>& loop_ends = {});

/// The map of a file, equal to the one that was saved to the bit, except for what Map remembers of
/// removed ids. Every checksum and every number is checked. The status of a failure names the file
/// and what is wrong: no such file, not a map, another version, another camera (kInvalid), damaged,
/// over the limits.
storage::Result<LoadedMap> load_map(const std::filesystem::path& path,
                                    const tracking::TrackingCamera& camera,
                                    const MapFileLimits& limits = {});

}  // namespace camvox::mapping
