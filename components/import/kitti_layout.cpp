#include "kitti_layout.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <chrono>

#include "import_error.hpp"
#include "text_file.hpp"

namespace camvox::import {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kListed = 5;  // numbers of missing files that a report names

bool is_drive(const fs::path& folder) {
  for (const auto* sensor :
       {"image_00", "image_01", "image_02", "image_03", "velodyne_points", "oxts"}) {
    if (fs::is_directory(folder / sensor)) return true;
  }
  return false;
}

/// The number at [at, at + length) of a text; -1 if it is none.
int digits(std::string_view text, std::size_t at, std::size_t length) {
  int value = -1;
  const auto part = text.substr(std::min(at, text.size()), length);
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
  return error == std::errc() && end == part.data() + length && part[0] != '-' ? value : -1;
}

std::int64_t parse_stamp(const TextFile& file) {
  using namespace std::chrono;
  const auto& line = file.line();
  const year_month_day date{year(digits(line, 0, 4)),
                            month(static_cast<unsigned>(digits(line, 5, 2))),
                            day(static_cast<unsigned>(digits(line, 8, 2)))};
  const int hour = digits(line, 11, 2), minute = digits(line, 14, 2), second = digits(line, 17, 2);
  auto fraction = line.size() > 20 && line[19] == '.' ? line.substr(20) : std::string("0");
  const auto length = fraction.size();
  const bool whole = file.fields().size() == 2 && length <= 9 &&
                     fraction.find_first_not_of("0123456789") == std::string::npos;
  if (!whole || !date.ok() || hour < 0 || hour > 23 || minute < 0 || minute > 59 || second < 0 ||
      second > 60) {
    file.fail("'" + line.substr(0, 40) + "' is no time stamp YYYY-MM-DD hh:mm:ss.fraction");
  }
  fraction.resize(9, '0');
  const auto days = sys_days(date).time_since_epoch();
  return duration_cast<nanoseconds>(days + hours(hour) + minutes(minute) + seconds(second))
             .count() +
         std::stoll(fraction);
}

void report_numbers(std::vector<std::size_t> numbers,
                    const fs::path& sensor,
                    const char* what,
                    std::vector<std::string>& out) {
  if (numbers.empty()) return;
  const auto count = numbers.size();
  numbers.resize(std::min(count, kListed));
  out.push_back(fmt::format("{}: {} for {} frames: {}{}",
                            sensor.filename().string(),
                            what,
                            count,
                            fmt::join(numbers, ", "),
                            count > kListed ? ", ..." : ""));
}

/// Files of the folder that no line of timestamps.txt stands for.
void report_strays(const fs::path& sensor, std::size_t used, ImportReport& report) {
  const auto files =
      std::distance(fs::directory_iterator(sensor / "data"), fs::directory_iterator());
  if (const auto strays = static_cast<std::size_t>(files) - used; strays > 0) {
    report.left_out.push_back(
        {sensor.filename().string() + "/data", strays, "files without a time stamp"});
  }
}

}  // namespace

KittiFolders find_kitti_folders(const fs::path& folder, const std::string& drive) {
  if (!fs::is_directory(folder)) fail_corrupt(folder, "is no folder");
  const auto whole = fs::absolute(folder).lexically_normal();
  if (!drive.empty()) {
    if (!is_drive(whole / drive)) fail_corrupt(folder / drive, "is no drive of KITTI raw");
    return {whole, whole / drive};
  }
  if (is_drive(whole)) {
    return {(whole.has_filename() ? whole : whole.parent_path()).parent_path(), whole};
  }
  std::vector<std::string> drives;
  for (const auto& entry : fs::directory_iterator(whole)) {
    if (entry.is_directory() && is_drive(entry)) drives.push_back(entry.path().filename());
  }
  std::ranges::sort(drives);
  if (drives.empty()) {
    fail_corrupt(folder,
                 "is neither a drive of KITTI raw (image_02, velodyne_points, oxts) nor the "
                 "folder of a date with drives");
  }
  if (drives.size() > 1) {
    fail_corrupt(folder,
                 fmt::format("has several drives, choose one: {}", fmt::join(drives, ", ")));
  }
  return {whole, whole / drives.front()};
}

std::vector<std::optional<std::int64_t>> read_kitti_stamps(const fs::path& path) {
  TextFile file(path);
  std::vector<std::optional<std::int64_t>> stamps;
  while (file.next()) {
    stamps.emplace_back();
    if (!file.fields().empty()) stamps.back() = parse_stamp(file);
  }
  while (!stamps.empty() && !stamps.back()) stamps.pop_back();
  return stamps;
}

std::vector<KittiFrame> list_kitti_frames(const fs::path& sensor,
                                          const std::vector<std::string>& extensions,
                                          ImportReport& report) {
  if (!fs::is_directory(sensor / "data")) {
    report.missing.push_back(sensor.filename().string() + ": no such folder with data");
    return {};
  }
  const auto stamps = read_kitti_stamps(sensor / "timestamps.txt");
  std::vector<KittiFrame> frames;
  std::vector<std::size_t> without_file, without_stamp;
  for (std::size_t number = 0; number < stamps.size(); ++number) {
    const auto stem = (sensor / "data" / fmt::format("{:010}", number)).string();
    const auto found = std::ranges::find_if(
        extensions, [&](const auto& extension) { return fs::exists(stem + extension); });
    if (found == extensions.end()) {
      without_file.push_back(number);
    } else if (!stamps[number]) {
      without_stamp.push_back(number);
    } else {
      frames.push_back({number, *stamps[number], stem + *found});
    }
  }
  report_numbers(without_file, sensor, "no file", report.missing);
  report_numbers(without_stamp, sensor, "no time stamp", report.missing);
  report_strays(sensor, frames.size(), report);
  return frames;
}

}  // namespace camvox::import
