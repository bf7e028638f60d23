#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "camvox/storage/record_reader.hpp"

namespace camvox::storage {

/// A message that is not in a chunk.
struct LooseMessage {
  std::uint64_t log_time_ns = 0;
  std::uint64_t offset = 0;  ///< Of the record in the file.
};

/// What is in a file and where.
struct Summary {
  Header header;
  std::map<std::uint16_t, Schema> schemas;
  std::map<std::uint16_t, Channel> channels;
  Statistics statistics;
  std::vector<ChunkIndex> chunk_indexes;  ///< In file order.
  std::vector<AttachmentIndex> attachment_indexes;
  std::vector<MetadataIndex> metadata_indexes;
  std::vector<LooseMessage> loose_messages;  ///< In file order; only when rebuilt.
  /// Made by reading the whole file, because its own summary is missing, incomplete or damaged.
  bool rebuilt = false;
  /// Why it was rebuilt, and what could not be read. A file in order has none.
  std::vector<FileProblem> problems;
};

/// The summary that the file ends with. An error when there is none, when it is damaged, or when it
/// does not lead to every message.
Result<Summary> read_summary(const Source& source, const ReadLimits& limits);

/// A summary made by reading the file from front to back as far as it goes. Only an error when it
/// is not an MCAP file at all. Chunks that cannot be read are left out and noted in `problems`.
Result<Summary> scan_summary(const Source& source, const ReadLimits& limits);

/// The file's own summary when it is good, else a scan.
Result<Summary> load_summary(const Source& source, const ReadLimits& limits);

}  // namespace camvox::storage
