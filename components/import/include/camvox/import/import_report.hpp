#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "camvox/import/message_bag_writer.hpp"

namespace camvox::import {

/// How far an import is, in units of the importer (messages, or bytes of the input).
struct ImportProgress {
  std::uint64_t done = 0;
  std::uint64_t total = 0;
};

/// What all importers take.
struct ImportOptions {
  /// Folder of the new bag, which must not exist; empty: named after the input, in the working
  /// folder.
  std::filesystem::path output;
  storage::BagWriterOptions bag;
  bool replace = false;  ///< A bag that stands at `output` makes way, once the new one is whole.
  /// Called from time to time; the import ends with an error when it returns false.
  std::function<bool(const ImportProgress&)> progress;
};

/// Data of the input that are not in the bag.
struct Omission {
  std::string what;  ///< "/diagnostics (diagnostic_msgs/DiagnosticArray)".
  std::uint64_t count = 0;
  std::string why;
};

/// What an importer found and made.
struct ImportReport {
  std::filesystem::path bag;
  std::vector<WrittenTopic> topics;
  std::vector<Omission> left_out;    ///< In the input, not in the bag.
  std::vector<std::string> missing;  ///< Expected in the input, not there.
  std::vector<std::string> notes;    ///< How data were interpreted where the format leaves it open.
};

}  // namespace camvox::import
