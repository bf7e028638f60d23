#include "camvox/trajectory/trajectory_file.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace camvox::trajectory {
namespace {

using storage::Result;
using storage::Status;
using storage::StatusCode;

constexpr std::int64_t kSecond_ns = 1'000'000'000;

Status error_at(const std::filesystem::path& file, std::size_t line, const std::string& what) {
  return {StatusCode::kCorrupt, fmt::format("{}:{}: {}", file.string(), line, what)};
}

std::vector<std::string_view> columns_of(std::string_view line) {
  std::vector<std::string_view> columns;
  const auto is_space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  std::size_t begin = 0;
  while (begin < line.size()) {
    while (begin < line.size() && is_space(line[begin])) ++begin;
    std::size_t end = begin;
    while (end < line.size() && !is_space(line[end])) ++end;
    if (end > begin) columns.push_back(line.substr(begin, end - begin));
    begin = end;
  }
  return columns;
}

std::optional<double> number(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

/// Seconds as ns. A double does not hold the ns of a time of today, so whole and decimal places are
/// read apart; another form ("1.3e9") goes through a double.
std::optional<std::int64_t> stamp_of(std::string_view text) {
  const auto point = std::min(text.find('.'), text.size());
  const auto whole = text.substr(0, point);
  auto decimals = point < text.size() ? std::string(text.substr(point + 1)) : std::string();
  decimals.resize(9, '0');
  std::int64_t seconds = 0;
  std::int64_t nanoseconds = 0;
  const auto read = [](std::string_view digits, std::int64_t& value) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    return error == std::errc() && end == digits.data() + digits.size();
  };
  if (!whole.starts_with('-') && read(whole, seconds) && read(decimals, nanoseconds) &&
      seconds < (std::int64_t{1} << 33)) {
    return seconds * kSecond_ns + nanoseconds;
  }
  const auto value = number(text);
  if (!value || std::abs(*value) > 9e9) return std::nullopt;
  return static_cast<std::int64_t>(std::llround(*value * 1e9));
}

/// Calls back with the columns of every line that has any.
template <typename Callback>
Status for_each_line(const std::filesystem::path& file, Callback&& callback) {
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file)) {
    return {StatusCode::kIo, fmt::format("{}: cannot be read", file.string())};
  }
  std::string line;
  for (std::size_t count = 1; std::getline(stream, line); ++count) {
    const auto columns = columns_of(std::string_view(line).substr(0, line.find('#')));
    if (columns.empty()) continue;
    if (auto status = callback(columns, count); !status.ok()) return status;
  }
  return {};
}

/// The numbers of `columns` from `first` on; empty if one is none.
std::vector<double> numbers(const std::vector<std::string_view>& columns, std::size_t first) {
  std::vector<double> values;
  for (std::size_t i = first; i < columns.size(); ++i) {
    const auto value = number(columns[i]);
    if (!value) return {};
    values.push_back(*value);
  }
  return values;
}

Status write_whole(const std::filesystem::path& file, const std::string& text) {
  auto temporary = file;
  temporary += ".part";
  std::ofstream stream(temporary, std::ios::trunc);
  const bool written = static_cast<bool>(stream << text << std::flush);
  std::error_code error;
  if (!written) error.assign(errno, std::generic_category());
  stream.close();
  if (written) std::filesystem::rename(temporary, file, error);
  if (!error) return {};
  const std::string why = error.message();
  std::filesystem::remove(temporary, error);
  return {StatusCode::kIo, fmt::format("{}: cannot be written: {}", file.string(), why)};
}

}  // namespace

Result<Trajectory> read_tum(const std::filesystem::path& file) {
  Trajectory trajectory;
  const auto status = for_each_line(file, [&](const auto& columns, std::size_t line) -> Status {
    if (columns.size() != 8) {
      return error_at(
          file, line, fmt::format("{} columns, not 8 (stamp x y z qx qy qz qw)", columns.size()));
    }
    const auto stamp_ns = stamp_of(columns[0]);
    const auto v = numbers(columns, 1);
    if (!stamp_ns || v.size() != 7) return error_at(file, line, "not a number");
    if (!trajectory.empty() && *stamp_ns == trajectory.back().stamp_ns) return {};
    if (!trajectory.empty() && *stamp_ns < trajectory.back().stamp_ns) {
      return error_at(file, line, "the stamp is before the one of the line before");
    }
    const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
    if (std::abs(q.norm() - 1.0) > 1e-3) return error_at(file, line, "not a unit quaternion");
    trajectory.push_back({*stamp_ns, {geometry::SO3(q), {v[0], v[1], v[2]}}});
    return {};
  });
  if (!status.ok()) return status;
  return trajectory;
}

Status write_tum(const std::filesystem::path& file, const Trajectory& trajectory) {
  std::string text = "# stamp_s x_m y_m z_m qx qy qz qw\n";
  for (const auto& [stamp_ns, T] : trajectory) {
    const auto& t = T.translation();
    const auto& q = T.rotation().quaternion();
    text += fmt::format("{}.{:09d} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                        stamp_ns / kSecond_ns,
                        stamp_ns % kSecond_ns,
                        t.x(),
                        t.y(),
                        t.z(),
                        q.x(),
                        q.y(),
                        q.z(),
                        q.w());
  }
  return write_whole(file, text);
}

Result<Trajectory> read_kitti(const std::filesystem::path& file, std::int64_t period_ns) {
  Trajectory trajectory;
  const auto status = for_each_line(file, [&](const auto& columns, std::size_t line) -> Status {
    if (columns.size() != 12) {
      return error_at(file, line, fmt::format("{} columns, not 12 (a 3x4 matrix)", columns.size()));
    }
    const auto v = numbers(columns, 0);
    if (v.size() != 12) return error_at(file, line, "not a number");
    Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
    T.topRows<3>() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(v.data());
    try {
      trajectory.push_back({static_cast<std::int64_t>(trajectory.size()) * period_ns,
                            geometry::SE3::from_matrix(T)});
    } catch (const std::logic_error&) {
      return error_at(file, line, "its left 3x3 part is not a rotation");
    }
    return {};
  });
  if (!status.ok()) return status;
  return trajectory;
}

Status write_kitti(const std::filesystem::path& file, const Trajectory& trajectory) {
  std::string text;
  for (const auto& pose : trajectory) {
    const Eigen::Matrix4d T = pose.T_world_body.matrix();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) {
        text += fmt::format("{:.9e}{}", T(row, column), row == 2 && column == 3 ? '\n' : ' ');
      }
    }
  }
  return write_whole(file, text);
}

Result<Trajectory> read_trajectory(const std::filesystem::path& file) {
  std::size_t count = 0;
  const auto status = for_each_line(file, [&](const auto& columns, std::size_t) -> Status {
    if (count == 0) count = columns.size();
    return {};
  });
  if (!status.ok()) return status;
  return count == 12 ? read_kitti(file) : read_tum(file);
}

}  // namespace camvox::trajectory
