#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "camvox/import/import_report.hpp"
#include "import_error.hpp"

namespace camvox::import {

/// The bag of one import. It grows in a folder with another name beside its place, which goes away
/// if the import fails, and gets its name when it is whole.
class ImportJob {
 public:
  /// `default_name` is that of the bag when the options give none.
  ImportJob(const ImportOptions& options, const std::string& default_name);
  ~ImportJob();
  ImportJob(const ImportJob&) = delete;
  ImportJob& operator=(const ImportJob&) = delete;

  template <typename T>
  void write(std::string_view topic, std::int64_t log_time_ns, const T& message) {
    require(writer_->write(std::string(topic), log_time_ns, message));
  }
  [[nodiscard]] MessageBagWriter& writer() { return *writer_; }
  /// Puts a file beside those of the bag.
  void write_file(const std::string& name, const std::string& text) const;

  /// Tells the caller; throws when it wants to stop.
  void progress(std::uint64_t done, std::uint64_t total);

  /// Closes the bag and gives it its name. An empty bag is an error.
  ImportReport finish();

  ImportReport report;

 private:
  void make_way() const;

  std::function<bool(const ImportProgress&)> progress_;
  bool replace_;
  std::filesystem::path workshop_;  ///< Holds the bag under its final name while it grows.
  std::unique_ptr<MessageBagWriter> writer_;
};

/// Name for a bag from that of a folder or file: its last part without `extension`.
[[nodiscard]] std::string name_from(const std::filesystem::path& input,
                                    const std::string& extension = {});

}  // namespace camvox::import
