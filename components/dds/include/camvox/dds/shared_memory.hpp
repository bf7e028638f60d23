#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace camvox::dds {

/// Bytes that are free in /dev/shm; 0 if it is not there.
[[nodiscard]] std::uint64_t free_shared_memory_bytes(const std::string& directory = "/dev/shm");

/// Removes what Fast DDS processes left in shared memory when they were killed: files of ours that
/// no process which we see has mapped or open, and whose lock nobody holds, also nobody in another
/// container that shares /dev/shm. What has no lock (zero_copy: interprocess) stays where there may
/// be such containers. Returns the names. Files younger than two seconds, and those of other users,
/// are left alone.
std::vector<std::string> remove_stale_shared_memory(const std::string& directory = "/dev/shm");

}  // namespace camvox::dds
