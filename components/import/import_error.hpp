#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "camvox/import/import_report.hpp"
#include "camvox/storage/status.hpp"

namespace camvox::import {

/// What ends an import. Stays inside the library: `guarded` turns it into a Status.
class ImportError : public std::runtime_error {
 public:
  ImportError(storage::StatusCode code, const std::string& message)
      : std::runtime_error(message), code_(code) {}
  explicit ImportError(const storage::Status& status)
      : ImportError(status.code(), status.message()) {}
  [[nodiscard]] storage::StatusCode code() const { return code_; }

 private:
  storage::StatusCode code_;
};

/// Input that breaks its format.
[[noreturn]] inline void fail_corrupt(const std::filesystem::path& file, const std::string& what) {
  throw ImportError(storage::StatusCode::kCorrupt, file.string() + ": " + what);
}

inline void require(const storage::Status& status) {
  if (!status.ok()) throw ImportError(status);
}

/// Runs an import; the errors on its way become the Status.
template <typename Function>
storage::Result<ImportReport> guarded(Function&& import) {
  try {
    return import();
  } catch (const ImportError& error) {
    return storage::Status(error.code(), error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    return storage::Status(storage::StatusCode::kIo, error.what());
  } catch (const std::bad_alloc&) {
    return storage::Status(storage::StatusCode::kLimit, "out of memory");
  }
}

}  // namespace camvox::import
