#pragma once

#include <cstdint>

namespace camvox::storage {

/// What a reader accepts before it allocates; a file is never trusted with the reader's memory.
struct ReadLimits {
  std::uint64_t max_record_size = 1ULL << 30;       ///< Content of one record.
  std::uint64_t max_chunk_size = 1ULL << 30;        ///< Declared uncompressed size of one chunk.
  std::uint64_t max_pending_messages = 1ULL << 25;  ///< Index entries of overlapping chunks.
};

/// Longest message that the writer takes, so that its chunk passes the default limits.
inline constexpr std::uint64_t kMaxMessageSize = (1ULL << 30) - (1ULL << 21);

}  // namespace camvox::storage
