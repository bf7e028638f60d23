#include "tum_lists.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "import_error.hpp"
#include "text_file.hpp"

namespace camvox::import {
namespace {

namespace fs = std::filesystem;

/// Calls `line` for each line that holds something.
template <typename Function>
void for_each_line(const fs::path& path, Function&& line) {
  TextFile file(path);
  while (file.next()) {
    if (!file.empty_line()) line(file);
  }
}

/// The list's file with its place checked; nothing, and a report, if it does not exist.
void add_file(std::vector<TumFile>& files,
              std::int64_t stamp_ns,
              const fs::path& path,
              std::size_t& missing) {
  if (fs::is_regular_file(path)) {
    files.push_back({stamp_ns, path});
  } else {
    ++missing;
  }
}

void report_missing(std::size_t count, const fs::path& list, ImportReport& report) {
  if (count == 0) return;
  report.missing.push_back(fmt::format("{}: {} of its files", list.filename().string(), count));
}

std::vector<TumFile> read_list(const fs::path& list, ImportReport& report) {
  std::vector<TumFile> files;
  if (!fs::exists(list)) {
    report.missing.push_back(list.filename().string());
    return files;
  }
  std::size_t missing = 0;
  for_each_line(list, [&](const TextFile& file) {
    if (file.fields().size() != 2) file.fail("expected 'timestamp filename'");
    add_file(files, file.seconds_as_ns(0), list.parent_path() / file.fields()[1], missing);
  });
  report_missing(missing, list, report);
  return files;
}

std::int64_t index_ns(const TextFile& file, std::size_t field, double rate_hz) {
  const double index = file.number(field);
  if (index < 0.0 || index > 1e9 || index != std::floor(index))
    file.fail("is no number of a frame");
  return std::llround(1e9 * index / rate_hz);
}

/// ICL-NUIM: "12 depth/12.png 12 rgb/12.png".
void read_associations(const fs::path& list,
                       double rate_hz,
                       TumLists& lists,
                       ImportReport& report) {
  std::size_t missing = 0;
  for_each_line(list, [&](const TextFile& file) {
    if (file.fields().size() != 4) file.fail("expected 'number depth-file number rgb-file'");
    const auto folder = list.parent_path();
    add_file(lists.depth, index_ns(file, 0, rate_hz), folder / file.fields()[1], missing);
    add_file(lists.color, index_ns(file, 2, rate_hz), folder / file.fields()[3], missing);
  });
  report_missing(missing, list, report);
  report.notes.push_back(fmt::format("frames have numbers: frame i is at i/{:g} s", rate_hz));
}

/// `rate_hz`: not 0 if the first field is the number of a frame.
std::vector<TumPose> read_poses(const fs::path& path, double rate_hz) {
  std::vector<TumPose> poses;
  for_each_line(path, [&](const TextFile& file) {
    const auto values = file.numbers(0, 8);
    const Eigen::Quaterniond q(values[7], values[4], values[5], values[6]);
    if (std::abs(q.norm() - 1.0) > 1e-2) file.fail("the quaternion is not of length 1");
    auto& pose = poses.emplace_back();
    pose.stamp_ns = rate_hz > 0.0 ? index_ns(file, 0, rate_hz) : file.seconds_as_ns(0);
    pose.T_map_camera = Eigen::Isometry3d(q.normalized());
    pose.T_map_camera.pretranslate(Eigen::Vector3d(values[1], values[2], values[3]));
  });
  return poses;
}

std::vector<TumAcceleration> read_accelerations(const fs::path& path) {
  std::vector<TumAcceleration> samples;
  for_each_line(path, [&](const TextFile& file) {
    const auto values = file.numbers(0, 4);
    samples.push_back({file.seconds_as_ns(0), Eigen::Vector3d(values[1], values[2], values[3])});
  });
  return samples;
}

/// "livingRoom0.gt.freiburg" of ICL-NUIM; empty if there is none.
fs::path find_icl_truth(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename().string().ends_with(".gt.freiburg")) return entry.path();
  }
  return {};
}

/// What is in the folder and has no topic.
void report_unused(const fs::path& folder, ImportReport& report) {
  constexpr std::array<std::string_view, 7> kUsed = {"rgb",
                                                     "depth",
                                                     "rgb.txt",
                                                     "depth.txt",
                                                     "groundtruth.txt",
                                                     "accelerometer.txt",
                                                     "associations.txt"};
  for (const auto& entry : fs::directory_iterator(folder)) {
    const auto name = entry.path().filename().string();
    if (std::ranges::find(kUsed, name) != kUsed.end() || name.ends_with(".gt.freiburg")) continue;
    report.left_out.push_back({name, 1, "no topic for it"});
  }
}

}  // namespace

TumLists read_tum_lists(const fs::path& folder, double index_rate_hz, ImportReport& report) {
  TumLists lists;
  const bool icl = !fs::exists(folder / "rgb.txt") && fs::exists(folder / "associations.txt");
  if (icl) {
    read_associations(folder / "associations.txt", index_rate_hz, lists, report);
  } else {
    lists.color = read_list(folder / "rgb.txt", report);
    lists.depth = read_list(folder / "depth.txt", report);
  }
  if (const auto truth = folder / "groundtruth.txt"; fs::exists(truth)) {
    lists.poses = read_poses(truth, icl ? index_rate_hz : 0.0);
  } else if (const auto icl_truth = find_icl_truth(folder); !icl_truth.empty()) {
    lists.poses = read_poses(icl_truth, index_rate_hz);
  } else {
    report.missing.emplace_back("groundtruth.txt");
  }
  if (fs::exists(folder / "accelerometer.txt")) {
    lists.accelerations = read_accelerations(folder / "accelerometer.txt");
  } else if (!icl) {
    report.missing.emplace_back("accelerometer.txt");
  }
  report_unused(folder, report);
  return lists;
}

}  // namespace camvox::import
