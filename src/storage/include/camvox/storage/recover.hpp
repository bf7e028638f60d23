#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "camvox/storage/record_reader.hpp"
#include "camvox/storage/writer.hpp"

namespace camvox::storage {

struct RecoverOptions {
  ReadLimits limits;
  /// Of the new file; profile and library are those of the old one.
  McapWriterOptions writer;
  /// Of the new file's chunks. Nothing: as in the old one.
  std::optional<Compression> compression;
  /// Called after each record with the bytes done; recovery ends when it returns false.
  std::function<bool(std::uint64_t bytes_done)> progress;
};

/// What `recover` found.
struct RecoverResult {
  /// Not ok when there is no new file: the input is no MCAP file, or the output cannot be written.
  Status status;
  /// Whether something was, or may have been, lost. The command's exit code is then 3.
  bool lost = false;
  /// Of the new file.
  Statistics statistics;
  /// Messages from a last chunk that was cut off; no CRC vouches for them.
  std::uint64_t unverified_messages = 0;
  /// What was wrong, where, and what that cost.
  std::vector<FileProblem> problems;
};

/// Copies every complete record of a file that was cut off or damaged into a new file with all
/// indexes. Chunks whose CRC differs are left out. Of a last chunk that was cut off, the complete
/// messages before the cut are kept. Behind a record whose length cannot be right, it goes on at
/// the next chunk that the summary, if there is one, knows of.
RecoverResult recover(const Source& in,
                      std::unique_ptr<Sink> out,
                      const RecoverOptions& options = {});

}  // namespace camvox::storage
