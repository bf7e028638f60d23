#include "camvox/dds/shared_memory.hpp"

#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>

namespace camvox::dds {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kYoungestStale_s = 2;  // a file this young may still be opened by its maker

bool is_fast_dds_file(const std::string& name) {
  return name.starts_with("fastrtps_") || name.starts_with("fast_datasharing_") ||
         name.starts_with("sem.fastrtps_");
}

/// Files below the directory that living processes have mapped. /proc is not readable for
/// processes of other users; their files are not ours to delete either.
std::set<std::string> mapped_files(const std::string& directory) {
  std::set<std::string> names;
  std::error_code ignored;
  for (const auto& process : fs::directory_iterator("/proc", ignored)) {
    std::ifstream maps(process.path() / "maps");
    for (std::string line; std::getline(maps, line);) {
      const auto start = line.find(directory + "/");
      if (start != std::string::npos) names.insert(line.substr(start + directory.size() + 1));
    }
    for (const auto& fd : fs::directory_iterator(process.path() / "fd", ignored)) {
      const auto target = fs::read_symlink(fd.path(), ignored);
      if (target.parent_path() == directory) names.insert(target.filename());
    }
  }
  return names;
}

bool is_old_and_ours(const fs::path& path) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0 || status.st_uid != geteuid()) return false;
  const auto now = std::chrono::duration_cast<std::chrono::seconds>(
                       std::chrono::system_clock::now().time_since_epoch())
                       .count();
  return now - status.st_ctime >= kYoungestStale_s;
}

}  // namespace

std::uint64_t free_shared_memory_bytes(const std::string& directory) {
  struct statvfs status {};
  if (statvfs(directory.c_str(), &status) != 0) return 0;
  return static_cast<std::uint64_t>(status.f_bavail) * status.f_frsize;
}

std::vector<std::string> remove_stale_shared_memory(const std::string& directory) {
  std::vector<std::string> candidates;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(directory, ignored)) {
    const std::string name = entry.path().filename();
    if (is_fast_dds_file(name) && is_old_and_ours(entry.path())) candidates.push_back(name);
  }
  if (candidates.empty()) return {};
  const auto used = mapped_files(directory);  // read after listing: a new user is never missed
  std::vector<std::string> removed;
  for (const auto& name : candidates) {
    if (!used.contains(name) && fs::remove(fs::path(directory) / name, ignored)) {
      removed.push_back(name);
    }
  }
  std::sort(removed.begin(), removed.end());
  return removed;
}

}  // namespace camvox::dds
