#pragma once

#include <string>
#include <vector>

#include "camvox/storage/record_reader.hpp"

namespace camvox::storage {

enum class Severity { kWarning, kError };

/// One thing that a file does not do as the format asks.
struct Finding {
  Severity severity = Severity::kError;
  std::uint64_t offset = 0;
  std::string message;
};

struct DoctorResult {
  std::vector<Finding> findings;  ///< In the order in which the file shows them; at most 1000.
  Statistics statistics;          ///< Counted from the records themselves.

  [[nodiscard]] bool has_errors() const;
};

/// Reads the whole file and checks all of it: structure, every CRC, definitions before their use
/// and never contradicting each other, times inside their chunk, and that all indexes and
/// statistics say what the data section says.
DoctorResult doctor(const Source& in, const ReadLimits& limits = {});

}  // namespace camvox::storage
