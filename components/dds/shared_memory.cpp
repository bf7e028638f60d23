#include "camvox/dds/shared_memory.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

namespace camvox::dds {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kYoungestStale_s = 2;  // a file this young may still be opened by its maker

bool is_fast_dds_file(const std::string& name) {
  return name.starts_with("fastrtps_") || name.starts_with("fast_datasharing_") ||
         name.starts_with("sem.fastrtps_");
}

/// A segment or port and what belongs to it have a name in common: fastrtps_X, fastrtps_X_el and
/// fastrtps_X_sl, sem.fastrtps_X_mutex.
std::string common_name(std::string name) {
  const auto drop_end = [&name](std::string_view end) {
    if (name.ends_with(end)) name.resize(name.size() - end.size());
  };
  if (name.starts_with("sem.")) name.erase(0, 4);
  for (const auto end : {"_mutex", "_el", "_sl"}) drop_end(end);
  return name;
}

bool is_lock(const std::string& name) { return name.ends_with("_el") || name.ends_with("_sl"); }

/// Whether a living process holds the lock, wherever it runs: a kernel lock knows no namespaces.
bool is_held(const fs::path& lock) {
  const int file = open(lock.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return true;
  const bool taken = flock(file, LOCK_EX | LOCK_NB) == 0;
  close(file);
  return !taken;
}

/// Files below the directory that processes which we may look into have mapped or open.
std::set<std::string> visibly_used(const std::string& directory) {
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

/// Whether we can look into all processes of our user that may use /dev/shm. Not so in a user or
/// process namespace of our own (a sandbox, a container) that shares the machine's memory.
bool all_users_are_visible() {
  // The machine's own namespaces have fixed numbers: include/linux/proc_ns.h of the kernel.
  const auto is_the_machines = [](const char* file, ino_t number) {
    struct stat status {};
    return stat(file, &status) == 0 && status.st_ino == number;
  };
  if (!is_the_machines("/proc/self/ns/ipc", 0xEFFFFFFF)) return true;  // shared memory of our own
  return is_the_machines("/proc/self/ns/user", 0xEFFFFFFD) &&
         is_the_machines("/proc/self/ns/pid", 0xEFFFFFFC);
}

bool is_old_and_ours(const fs::path& path) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0 || status.st_uid != geteuid()) return false;
  const auto now = std::chrono::duration_cast<std::chrono::seconds>(
                       std::chrono::system_clock::now().time_since_epoch())
                       .count();
  return now - status.st_ctime >= kYoungestStale_s;
}

/// Whether files with a common name may belong to nobody any more, as far as they tell themselves.
bool may_be_stale(const fs::path& folder, const std::vector<std::string>& names) {
  bool had_lock = false;
  for (const auto& name : names) {
    if (!is_old_and_ours(folder / name)) return false;
    if (!is_lock(name)) continue;
    if (is_held(folder / name)) return false;
    had_lock = true;
  }
  return had_lock || all_users_are_visible();
}

}  // namespace

std::uint64_t free_shared_memory_bytes(const std::string& directory) {
  struct statvfs status {};
  if (statvfs(directory.c_str(), &status) != 0) return 0;
  return static_cast<std::uint64_t>(status.f_bavail) * status.f_frsize;
}

std::vector<std::string> remove_stale_shared_memory(const std::string& directory) {
  std::map<std::string, std::vector<std::string>> groups;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(directory, ignored)) {
    const std::string name = entry.path().filename();
    if (is_fast_dds_file(name)) groups[common_name(name)].push_back(name);
  }
  std::erase_if(groups, [&](const auto& group) { return !may_be_stale(directory, group.second); });
  if (groups.empty()) return {};
  const auto used = visibly_used(directory);  // read after listing: a new user is never missed
  const auto is_used = [&used](const std::string& name) { return used.contains(name); };
  std::vector<std::string> removed;
  for (const auto& [common, names] : groups) {
    if (std::any_of(names.begin(), names.end(), is_used)) continue;
    for (const auto& name : names) {
      if (fs::remove(fs::path(directory) / name, ignored)) removed.push_back(name);
    }
  }
  std::sort(removed.begin(), removed.end());
  return removed;
}

}  // namespace camvox::dds
