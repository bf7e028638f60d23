#include "camvox/features/corner_detector.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>

#include "camvox/config/target_clones.hpp"

namespace camvox::features {
namespace {

using Byte = std::uint8_t;

constexpr int kBlock = 32;   // pixels scored together: one AVX2 register
constexpr int kMargin = 32;  // zeros left of the scores of a row
constexpr int kRadius = 3;

CAMVOX_ALWAYS_INLINE Byte smaller(Byte a, Byte b) { return a < b ? a : b; }
CAMVOX_ALWAYS_INLINE Byte larger(Byte a, Byte b) { return a > b ? a : b; }
/// a - b, or 0 when that is negative.
CAMVOX_ALWAYS_INLINE Byte excess(Byte a, Byte b) { return static_cast<Byte>(larger(a, b) - b); }

CAMVOX_ALWAYS_INLINE bool any(const Byte* block) {
  std::uint64_t words[kBlock / 8];
  std::memcpy(words, block, sizeof words);
  return (words[0] | words[1] | words[2] | words[3]) != 0;
}

/// The circle of 16 pixels around a pixel, clockwise from the top.
struct Circle {
  std::ptrdiff_t offset[16];
  explicit Circle(std::ptrdiff_t step)
      : offset{-3 * step,
               -3 * step + 1,
               -2 * step + 2,
               -step + 3,
               3,
               step + 3,
               2 * step + 2,
               3 * step + 1,
               3 * step,
               3 * step - 1,
               2 * step - 2,
               step - 3,
               -3,
               -step - 3,
               -2 * step - 2,
               -3 * step - 1} {}
};

/// How far two neighbouring of the pixels `offset[first + 4 k]` differ from the centre on the same
/// side at most. An arc of 9 holds two such, so that no corner scores more.
CAMVOX_ALWAYS_INLINE Byte score_bound(const Byte* p, const std::ptrdiff_t* offset, int first) {
  const Byte a = p[offset[first]];
  const Byte b = p[offset[first + 4]];
  const Byte c = p[offset[first + 8]];
  const Byte d = p[offset[first + 12]];
  const Byte bright = smaller(larger(a, c), larger(b, d));
  const Byte dark = larger(smaller(a, c), smaller(b, d));
  return larger(excess(bright, *p), excess(*p, dark));
}

/// The blocks of a row that may hold a corner, as offsets from `row`; returns how many.
CAMVOX_TARGET_CLONES int find_candidate_blocks(
    const Byte* row, std::ptrdiff_t step, int blocks, Byte threshold, std::int32_t* found) {
  const Circle circle(step);
  int count = 0;
  for (int block = 0; block < blocks; ++block) {
    const Byte* p = row + block * kBlock;
    alignas(kBlock) Byte above[kBlock];
    for (int i = 0; i < kBlock; ++i) {
      above[i] = excess(
          smaller(score_bound(p + i, circle.offset, 0), score_bound(p + i, circle.offset, 2)),
          threshold);
    }
    found[count] = block * kBlock;
    count += any(above) ? 1 : 0;
  }
  return count;
}

/// The score of FAST-9/16: the larger of (the largest minimum over arcs of 9, minus the centre)
/// and (the centre minus the smallest maximum). Arcs that start at k and k + 1 share 8 pixels.
CAMVOX_ALWAYS_INLINE Byte corner_score(const Byte* p, const std::ptrdiff_t* offset) {
  Byte c[16];
  for (int k = 0; k < 16; ++k) c[k] = p[offset[k]];
  Byte low2[8];
  Byte high2[8];
  for (int k = 0; k < 8; ++k) {
    low2[k] = smaller(c[2 * k + 1], c[(2 * k + 2) % 16]);
    high2[k] = larger(c[2 * k + 1], c[(2 * k + 2) % 16]);
  }
  Byte low4[8];
  Byte high4[8];
  for (int k = 0; k < 8; ++k) {
    low4[k] = smaller(low2[k], low2[(k + 1) % 8]);
    high4[k] = larger(high2[k], high2[(k + 1) % 8]);
  }
  Byte bright = 0;
  Byte dark = 255;
  for (int k = 0; k < 8; ++k) {
    const Byte first = c[2 * k];
    const Byte last = c[(2 * k + 9) % 16];
    const Byte low = smaller(low4[k], low4[(k + 2) % 8]);
    const Byte high = larger(high4[k], high4[(k + 2) % 8]);
    bright = larger(bright, smaller(low, larger(first, last)));
    dark = smaller(dark, larger(high, smaller(first, last)));
  }
  return larger(excess(bright, *p), excess(*p, dark));
}

/// Writes the scores above `threshold`, else 0, of the listed blocks (`row` and `scores` are of the
/// first block); keeps in the list the blocks that hold any and returns how many.
CAMVOX_TARGET_CLONES int score_blocks(const Byte* row,
                                      std::ptrdiff_t step,
                                      Byte threshold,
                                      std::int32_t* blocks,
                                      int count,
                                      Byte* scores) {
  const Circle circle(step);
  int kept = 0;
  for (int n = 0; n < count; ++n) {
    const std::int32_t start = blocks[n];
    Byte* out = scores + start;
    for (int i = 0; i < kBlock; ++i) {
      const Byte score = corner_score(row + start + i, circle.offset);
      out[i] = score > threshold ? score : static_cast<Byte>(0);
    }
    blocks[kept] = start;
    kept += any(out) ? 1 : 0;
  }
  return kept;
}

/// The scores of a block that no neighbour exceeds (nor, when later in reading order, equals).
CAMVOX_TARGET_CLONES void keep_maxima(const Byte* above,
                                      const Byte* scores,
                                      const Byte* below,
                                      Byte* maxima) {
  for (int i = 0; i < kBlock; ++i) {
    const Byte s = scores[i];
    const Byte before = larger(larger(above[i - 1], above[i]), larger(above[i + 1], scores[i - 1]));
    const Byte after = larger(larger(below[i - 1], below[i]), larger(below[i + 1], scores[i + 1]));
    maxima[i] = s >= before && s > after ? s : static_cast<Byte>(0);
  }
}

}  // namespace

/// Where corners may be, and its cells.
struct CornerDetector::Region {
  int begin;
  int end_u;
  int end_v;
  int cells_u;
  int cells_v;

  explicit Region(const ImageView& image)
      : begin(kBorder_px),
        end_u(image.width_px - kBorder_px),
        end_v(image.height_px - kBorder_px),
        cells_u((end_u - begin + kCell_px - 1) / kCell_px),
        cells_v((end_v - begin + kCell_px - 1) / kCell_px) {}
  [[nodiscard]] bool empty() const { return end_u <= begin || end_v <= begin; }
  [[nodiscard]] int blocks() const { return (end_u - begin + kBlock - 1) / kBlock; }
  [[nodiscard]] int cell(int u, int v) const {
    return (v - begin) / kCell_px * cells_u + (u - begin) / kCell_px;
  }
};

CornerDetector::CornerDetector(int threshold, int low_threshold)
    : threshold_(threshold), low_threshold_(std::min(threshold, low_threshold)) {}

void CornerDetector::detect(const ImageView& image, std::vector<Corner>& corners) {
  corners.clear();
  const Region region(image);
  if (region.empty()) return;
  const auto cells = static_cast<std::size_t>(region.cells_u * region.cells_v);
  cell_filled_.assign(cells, 0);
  detect_rows(image, region, corners);
  for (const Corner& corner : corners) {
    cell_filled_[static_cast<std::size_t>(region.cell(corner.u_px, corner.v_px))] = 1;
  }
  if (low_threshold_ == threshold_) return;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    if (cell_filled_[cell] == 0) detect_cell(image, region, static_cast<int>(cell), corners);
  }
}

namespace {

/// A run of pixels of a row.
struct Run {
  int u = 0;
  int v = 0;
  int end_u = 0;
};

/// Appends the maxima among the scores of a block.
void collect(const Byte* maxima, const Run& run, std::vector<Corner>& corners) {
  for (int word = 0; word < kBlock / 8; ++word) {
    std::uint64_t bytes;
    std::memcpy(&bytes, maxima + 8 * word, sizeof bytes);
    for (int i = 8 * word; bytes != 0; bytes >>= 8, ++i) {
      const int zeros = std::countr_zero(bytes) / 8;
      bytes >>= 8 * zeros;
      i += zeros;
      if (run.u + i >= run.end_u) return;
      corners.push_back(
          {static_cast<std::uint16_t>(run.u + i), static_cast<std::uint16_t>(run.v), maxima[i]});
    }
  }
}

}  // namespace

void CornerDetector::detect_rows(const ImageView& image,
                                 const Region& region,
                                 std::vector<Corner>& corners) {
  const auto threshold = static_cast<Byte>(threshold_);
  const int blocks = region.blocks();
  const auto width = static_cast<std::size_t>(blocks * kBlock + 2 * kMargin);
  score_rows_.assign(3 * width, 0);
  for (auto& list : blocks_) list.resize(static_cast<std::size_t>(blocks) + 1);
  Byte* rows[3] = {score_rows_.data() + kMargin,
                   score_rows_.data() + width + kMargin,
                   score_rows_.data() + 2 * width + kMargin};
  int counts[3] = {0, 0, 0};
  alignas(kBlock) Byte maxima[kBlock];
  for (int v = region.begin; v <= region.end_v; ++v) {  // one row more: finishes the last
    Byte* scores = rows[v % 3];
    const Byte* middle = rows[(v + 2) % 3];
    const Byte* above = rows[(v + 1) % 3];
    auto& list = blocks_[v % 3];
    int& count = counts[v % 3];
    for (int n = 0; n < count; ++n)
      std::memset(scores + list[static_cast<std::size_t>(n)], 0, kBlock);
    count = 0;
    if (v < region.end_v) {
      const Byte* row = image.at(region.begin, v);
      count = find_candidate_blocks(row, image.step_bytes, blocks, threshold, list.data());
      count = score_blocks(row, image.step_bytes, threshold, list.data(), count, scores);
      std::memset(scores + region.end_u - region.begin,
                  0,
                  static_cast<std::size_t>(blocks * kBlock - (region.end_u - region.begin)));
    }
    const auto& previous = blocks_[(v + 2) % 3];
    for (int n = 0; n < counts[(v + 2) % 3]; ++n) {
      const int start = previous[static_cast<std::size_t>(n)];
      keep_maxima(above + start, middle + start, scores + start, maxima);
      collect(maxima, {region.begin + start, v - 1, region.end_u}, corners);
    }
  }
}

void CornerDetector::detect_cell(const ImageView& image,
                                 const Region& region,
                                 int cell,
                                 std::vector<Corner>& corners) {
  static_assert(kCell_px + 2 == kBlock, "a cell and its neighbours are one block wide");
  const auto threshold = static_cast<Byte>(low_threshold_);
  const int begin_u = region.begin + cell % region.cells_u * kCell_px;
  const int begin_v = region.begin + cell / region.cells_u * kCell_px;
  const int end_v = std::min(begin_v + kCell_px, region.end_v);
  const int end_u = std::min(begin_u + kCell_px, region.end_u);
  // Scores of the cell and of one pixel around it, where the region has such.
  alignas(kBlock) Byte scores[kCell_px + 2][kBlock + 2 * kMargin] = {};
  bool found = false;
  for (int v = std::max(begin_v - 1, region.begin); v < std::min(end_v + 1, region.end_v); ++v) {
    const Byte* row = image.at(begin_u - 1, v);
    Byte* out = scores[v - begin_v + 1] + kMargin;
    std::int32_t block[2];
    if (find_candidate_blocks(row, image.step_bytes, 1, threshold, block) == 0) continue;
    if (score_blocks(row, image.step_bytes, threshold, block, 1, out) == 0) continue;
    found = true;
    if (begin_u == region.begin) out[0] = 0;
    for (int i = 0; i < kBlock; ++i)
      out[i] = i > region.end_u - begin_u ? static_cast<Byte>(0) : out[i];
  }
  if (!found) return;
  alignas(kBlock) Byte maxima[kBlock];
  for (int v = begin_v; v < end_v; ++v) {
    const Byte* row = scores[v - begin_v + 1] + kMargin;
    if (!any(row)) continue;
    keep_maxima(scores[v - begin_v] + kMargin, row, scores[v - begin_v + 2] + kMargin, maxima);
    maxima[0] = 0;  // belongs to the cell on the left
    collect(maxima, {begin_u - 1, v, end_u}, corners);
  }
}

namespace {

/// The place of the vertex of a parabola through three scores. The middle one is the largest, but
/// for corners at the edge of where corners are looked for.
float vertex(int before, int middle, int after) {
  const int curvature = 2 * middle - before - after;
  if (curvature <= 0) return 0.0F;
  return std::clamp(
      0.5F * static_cast<float>(after - before) / static_cast<float>(curvature), -0.5F, 0.5F);
}

}  // namespace

CAMVOX_TARGET_CLONES Shift refine_corner(const ImageView& image, const Corner& corner) {
  // The 9x9 pixels around the corner, row after row: the scores of its 3x3 neighbours then lie
  // within one block.
  constexpr int kReach = kRadius + 1;
  constexpr int kSide = 2 * kReach + 1;
  constexpr int kFirst = kRadius * kSide + kRadius;  // of the neighbours
  Byte patch[kFirst + 2 * kBlock + 16];
  const Byte* from = image.at(corner.u_px - kReach, corner.v_px - kReach);
  for (int r = 0; r < kSide; ++r) {
    std::memcpy(patch + r * kSide, from + r * image.step_bytes, kSide);
  }
  std::memset(patch + kSide * kSide, 0, sizeof patch - kSide * kSide);
  const Circle circle(kSide);
  alignas(kBlock) Byte scores[kBlock];
  for (int i = 0; i < kBlock; ++i) scores[i] = corner_score(patch + kFirst + i, circle.offset);
  const Byte* centre = scores + kSide + 1;
  return {vertex(centre[-1], centre[0], centre[1]),
          vertex(centre[-kSide], centre[0], centre[kSide])};
}

}  // namespace camvox::features
