#include "camvox/features/feature_grid.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace camvox::features {

using Eigen::Vector2f;

FeatureGrid::FeatureGrid(const FrameFeatures& features) {
  const std::size_t count = features.size();
  if (count > 65536) throw std::logic_error("more features than a grid can hold");
  if (count == 0) return;
  const bool raw = features.undistorted_px.empty();
  const auto place = [&](std::size_t i) {
    const KeyPoint& key_point = features.key_points[i];
    return raw ? Vector2f(key_point.u_px, key_point.v_px) : features.undistorted_px[i];
  };
  origin_px_ = place(0);
  Vector2f end_px = origin_px_;
  for (std::size_t i = 1; i < count; ++i) {
    origin_px_ = origin_px_.cwiseMin(place(i));
    end_px = end_px.cwiseMax(place(i));
  }
  cells_per_px_ =
      Vector2f(kColumns, kRows).cwiseQuotient((end_px - origin_px_).array().max(1.0F).matrix());
  // Counting sort by cell.
  starts_.assign(kColumns * kRows + 1, 0);
  std::vector<std::uint16_t> cells(count);
  for (std::size_t i = 0; i < count; ++i) {
    cells[i] = static_cast<std::uint16_t>(row(place(i).y()) * kColumns + column(place(i).x()));
    ++starts_[cells[i] + 1U];
  }
  for (std::size_t cell = 1; cell < starts_.size(); ++cell) starts_[cell] += starts_[cell - 1];
  entries_.resize(count);
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  for (std::size_t i = 0; i < count; ++i) {
    entries_[next[cells[i]]++] = {
        place(i).x(), place(i).y(), static_cast<std::uint16_t>(i), features.key_points[i].octave};
  }
}

int FeatureGrid::column(float u_px) const {
  const float cell = (u_px - origin_px_.x()) * cells_per_px_.x();
  return static_cast<int>(std::clamp(cell, 0.0F, static_cast<float>(kColumns - 1)));
}

int FeatureGrid::row(float v_px) const {
  const float cell = (v_px - origin_px_.y()) * cells_per_px_.y();
  return static_cast<int>(std::clamp(cell, 0.0F, static_cast<float>(kRows - 1)));
}

void FeatureGrid::find(const SearchArea& area, std::vector<std::uint32_t>& found) const {
  found.clear();
  if (entries_.empty() || !area.u_px.allFinite() || !(area.radius_px >= 0.0F)) return;
  const int first_column = column(area.u_px.x() - area.radius_px);
  const int end_column = column(area.u_px.x() + area.radius_px) + 1;
  const int first_row = row(area.u_px.y() - area.radius_px);
  const int last_row = row(area.u_px.y() + area.radius_px);
  const auto start = [&](int r, int c) {
    return starts_[static_cast<std::size_t>(r * kColumns + c)];
  };
  std::size_t most = 0;
  for (int r = first_row; r <= last_row; ++r) most += start(r, end_column) - start(r, first_column);
  found.resize(most);
  std::size_t count = 0;
  for (int r = first_row; r <= last_row; ++r) {
    const std::uint32_t end = start(r, end_column);
    for (std::uint32_t i = start(r, first_column); i < end; ++i) {
      // Written first and counted after: half of the entries are outside, which no branch foresees.
      const Entry& entry = entries_[i];
      found[count] = entry.index;
      const bool inside_u = std::abs(entry.u_px - area.u_px.x()) <= area.radius_px;
      const bool inside_v = std::abs(entry.v_px - area.u_px.y()) <= area.radius_px;
      const bool seen = (entry.octave >= area.min_octave) & (entry.octave <= area.max_octave);
      count += static_cast<std::size_t>(inside_u & inside_v & seen);
    }
  }
  found.resize(count);
}

std::vector<std::uint32_t> FeatureGrid::find(const SearchArea& area) const {
  std::vector<std::uint32_t> found;
  find(area, found);
  return found;
}

}  // namespace camvox::features
