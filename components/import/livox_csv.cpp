#include "camvox/import/livox_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "camvox/interfaces/livox_ros_driver2.hpp"
#include "import_job.hpp"
#include "messages.hpp"
#include "text_file.hpp"

namespace camvox::import {
namespace {

namespace fs = std::filesystem;
using livox_ros_driver2::msg::CustomMsg;
using livox_ros_driver2::msg::CustomPoint;

constexpr double kMaxRange_m = 2000.0;  // no Livox lidar sees farther: the numbers are no metres

/// Where a column is in a row.
struct Columns {
  std::size_t x = 0, y = 1, z = 2;
  std::size_t reflectivity = 3;
  std::optional<std::size_t> offset_time, tag, line;
  std::size_t count = 4;
};

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

/// True for a row of names, which then say what the columns are.
bool read_names(const TextFile& file, Columns& columns, ImportReport& report) {
  const auto& fields = file.fields();
  if (fields[0].find_first_of("0123456789") != std::string_view::npos) return false;
  std::optional<std::size_t> x, y, z, reflectivity;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto name = lower(fields[i]);
    auto* column = name == "x"                                     ? &x
                   : name == "y"                                   ? &y
                   : name == "z"                                   ? &z
                   : name == "reflectivity" || name == "intensity" ? &reflectivity
                   : name == "offset_time"                         ? &columns.offset_time
                   : name == "tag"                                 ? &columns.tag
                   : name == "line"                                ? &columns.line
                                                                   : nullptr;
    if (column == nullptr) {
      report.left_out.push_back({"column '" + std::string(fields[i]) + "'", 1, "unknown name"});
    } else if (*column) {
      file.fail("column " + name + " comes twice");
    } else {
      *column = i;
    }
  }
  if (!x || !y || !z || !reflectivity) {
    file.fail("needs columns x, y, z and intensity or reflectivity");
  }
  columns = {
      *x, *y, *z, *reflectivity, columns.offset_time, columns.tag, columns.line, fields.size()};
  return true;
}

class LivoxCsvImport {
 public:
  LivoxCsvImport(const fs::path& path, const LivoxCsvOptions& options)
      : job_(options, name_from(path, ".csv")),
        options_(options),
        file_(path, ','),
        size_(fs::file_size(path)) {}

  ImportReport run() {
    bool first = true;
    while (file_.next()) {
      bytes_read_ += file_.line().size() + 1;
      if (file_.empty_line()) continue;
      if (std::exchange(first, false) && read_names(file_, columns_, job_.report)) continue;
      add_row();
    }
    send();
    describe();
    job_.progress(size_, size_);
    return job_.finish();
  }

 private:
  void add_row() {
    if (file_.fields().size() != columns_.count) {
      file_.fail(fmt::format("has {} fields, not {}", file_.fields().size(), columns_.count));
    }
    const auto time_ns = next_time_ns();
    while (time_ns >= message_begin_ns_ + options_.message_ns) {
      send();
      message_begin_ns_ +=
          (time_ns - message_begin_ns_) / options_.message_ns * options_.message_ns;
    }
    const auto x = coordinate(columns_.x), y = coordinate(columns_.y), z = coordinate(columns_.z);
    const auto row = rows_++;
    if (x == 0.0F && y == 0.0F && z == 0.0F) {
      ++without_return_;
      return;
    }
    if (points_.empty()) timebase_ns_ = time_ns;
    CustomPoint point;
    point.offset_time(static_cast<std::uint32_t>(time_ns - timebase_ns_));
    point.x(x);
    point.y(y);
    point.z(z);
    point.reflectivity(byte(columns_.reflectivity));
    point.tag(columns_.tag ? byte(*columns_.tag) : std::uint8_t{0});
    point.line(columns_.line
                   ? byte(*columns_.line)
                   : static_cast<std::uint8_t>(row % static_cast<unsigned>(options_.lines)));
    points_.push_back(point);
  }

  std::int64_t next_time_ns() {
    if (!columns_.offset_time) {
      return static_cast<std::int64_t>(rows_) * options_.point_interval_ns;
    }
    const double offset_ns = file_.number(*columns_.offset_time);
    if (offset_ns < 0.0 || offset_ns > 1e18) file_.fail("offset_time is out of range");
    const auto time_ns = std::llround(offset_ns);
    if (time_ns < last_time_ns_) file_.fail("offset_time goes back");
    return last_time_ns_ = time_ns;
  }

  [[nodiscard]] float coordinate(std::size_t column) const {
    const double value_m = file_.number(column);
    if (std::abs(value_m) > kMaxRange_m) {
      file_.fail(fmt::format("{:g} m is no distance of a Livox lidar", value_m));
    }
    return static_cast<float>(value_m);
  }

  [[nodiscard]] std::uint8_t byte(std::size_t column) const {
    const double value = file_.number(column);
    if (value < 0.0 || value > 255.0) file_.fail(fmt::format("{:g} is not in 0 to 255", value));
    return static_cast<std::uint8_t>(std::lround(value));
  }

  /// Writes the message that is complete, if it has points; logged when its last point was there.
  void send() {
    if (points_.empty()) return;
    job_.progress(std::min(bytes_read_, size_), size_);
    const auto stamp_ns = options_.start_ns + timebase_ns_;
    const auto end_ns = stamp_ns + points_.back().offset_time();
    CustomMsg message;
    message.header(interfaces::to_header(stamp_ns, kLivoxFrame));
    message.timebase(static_cast<std::uint64_t>(stamp_ns));
    message.point_num(static_cast<std::uint32_t>(points_.size()));
    message.points(std::move(points_));
    points_ = {};
    job_.write(options_.topic, end_ns, message);
  }

  void describe() {
    auto& report = job_.report;
    if (without_return_ > 0)
      report.left_out.push_back({"points", without_return_, "(0, 0, 0): no return"});
    if (!columns_.offset_time) {
      report.notes.push_back(
          fmt::format("no times in the file: {} ns from row to row", options_.point_interval_ns));
    }
    if (!columns_.line) {
      report.notes.push_back(fmt::format("no lines in the file: row modulo {}", options_.lines));
    }
    if (!columns_.tag) report.notes.push_back("no tags in the file: 0, a normal first return");
  }

  ImportJob job_;
  LivoxCsvOptions options_;
  TextFile file_;
  std::uint64_t size_;
  std::uint64_t bytes_read_ = 0;
  Columns columns_;
  std::uint64_t rows_ = 0;
  std::uint64_t without_return_ = 0;
  std::int64_t last_time_ns_ = 0;
  std::int64_t message_begin_ns_ = 0;
  std::int64_t timebase_ns_ = 0;
  std::vector<CustomPoint> points_;
};

void check(const LivoxCsvOptions& options) {
  const bool good = options.point_interval_ns > 0 && options.lines > 0 && options.lines <= 256 &&
                    options.message_ns > 0 && options.message_ns < 4'000'000'000 &&
                    options.start_ns >= 0;
  if (!good) {
    throw ImportError(storage::StatusCode::kInvalid,
                      "point interval and message must be longer than 0 and shorter than 4 s, "
                      "lines 1 to 256, the start not before 1970");
  }
}

}  // namespace

storage::Result<ImportReport> import_livox_csv(const fs::path& file,
                                               const LivoxCsvOptions& options) {
  return guarded([&] {
    check(options);
    if (!fs::is_regular_file(file)) fail_corrupt(file, "is no file");
    return LivoxCsvImport(file, options).run();
  });
}

}  // namespace camvox::import
