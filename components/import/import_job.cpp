#include "import_job.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

namespace camvox::import {

namespace fs = std::filesystem;
using storage::StatusCode;

ImportJob::ImportJob(const ImportOptions& options, const std::string& default_name)
    : progress_(options.progress), replace_(options.replace) {
  fs::path bag = options.output.empty() ? fs::path(default_name) : options.output;
  if (!bag.has_filename()) bag = bag.parent_path();  // "name/" means "name"
  if (fs::exists(fs::symlink_status(bag))) {
    if (!replace_) {
      throw ImportError(StatusCode::kInvalid, bag.string() + " exists; choose another output");
    }
    if (!fs::exists(bag / "metadata.yaml")) {
      throw ImportError(StatusCode::kInvalid, bag.string() + " is no bag; it is not replaced");
    }
  }
  report.bag = bag;
  workshop_ = bag;
  workshop_ += ".partial-" + std::to_string(getpid());
  fs::create_directories(workshop_);
  auto writer = MessageBagWriter::create(workshop_ / bag.filename(), options.bag);
  if (!writer.ok()) {
    fs::remove_all(workshop_);
    throw ImportError(writer.status());
  }
  writer_ = *std::move(writer);
}

ImportJob::~ImportJob() {
  writer_.reset();
  std::error_code ignored;  // the error that led here is what the caller should see
  fs::remove_all(workshop_, ignored);
}

void ImportJob::progress(std::uint64_t done, std::uint64_t total) {
  if (progress_ && !progress_({done, total})) {
    throw ImportError(StatusCode::kInvalid, "interrupted; nothing is left behind");
  }
}

ImportReport ImportJob::finish() {
  report.topics = writer_->topics();
  if (std::ranges::all_of(report.topics, [](const auto& t) { return t.message_count == 0; })) {
    throw ImportError(StatusCode::kInvalid, "the input has nothing that can be imported");
  }
  require(writer_->close());
  writer_.reset();
  make_way();
  fs::rename(workshop_ / report.bag.filename(), report.bag);
  return std::move(report);
}

void ImportJob::make_way() const {
  if (!fs::exists(fs::symlink_status(report.bag))) return;
  // Rename replaces an empty folder: one that came meanwhile must not be taken for ours.
  if (!replace_) throw ImportError(StatusCode::kInvalid, report.bag.string() + " exists by now");
  fs::rename(report.bag, workshop_ / "replaced");  // goes away with the workshop
}

void ImportJob::write_file(const std::string& name, const std::string& text) const {
  const auto path = workshop_ / report.bag.filename() / name;
  errno = 0;
  std::ofstream stream(path, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) {
    throw ImportError(StatusCode::kIo, path.string() + ": write failed: " + std::strerror(errno));
  }
}

std::string name_from(const fs::path& input, const std::string& extension) {
  const auto whole = fs::absolute(input).lexically_normal();
  auto name = (whole.has_filename() ? whole : whole.parent_path()).filename().string();
  if (!extension.empty() && name.size() > extension.size() && name.ends_with(extension)) {
    name.resize(name.size() - extension.size());
  }
  return name.empty() ? "imported" : name;
}

}  // namespace camvox::import
