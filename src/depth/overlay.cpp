#include "camvox/depth/overlay.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace camvox::depth {
namespace {

constexpr int kLeastWidth_px = 640;      // for a line of text
constexpr double kUnfilledShade = 0.75;  // of the image where there is no depth
constexpr double kDarkestShade = 0.45;   // of a depth's colour where the image is black
constexpr double kNearShare = 0.002;     // of the depths, that may be nearer than the scale's end
constexpr int kColours = 256;
const cv::Scalar kPaper(24, 24, 24);
const cv::Scalar kInk(235, 235, 235);
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;

/// From 0 (as far as the scale goes) to 1 (near), linear in inverse depth.
struct InverseScale {
  double near_m = 0.0;
  double far_m = 0.0;

  [[nodiscard]] double share(double z_m) const {
    const double low = 1.0 / far_m, high = 1.0 / near_m;
    return high > low ? std::clamp((1.0 / z_m - low) / (high - low), 0.0, 1.0) : 1.0;
  }
};

template <typename Visit>
void for_each_depth(const DepthView& depth, Visit visit) {
  for (int v = 0; v < depth.height_px; ++v) {
    const float* row = depth.depth_m + static_cast<std::ptrdiff_t>(v) * depth.width_px;
    for (int u = 0; u < depth.width_px; ++u) {
      if (row[u] > 0.0F) visit(u, v, row[u]);
    }
  }
}

/// One stray near pixel must not take the colours from all others.
InverseScale scale_of(const DepthView& depth, const DepthSummary& summary) {
  std::vector<float> depths_m;
  for_each_depth(depth, [&](int, int, float z_m) { depths_m.push_back(z_m); });
  const auto nth = static_cast<std::ptrdiff_t>(kNearShare * static_cast<double>(depths_m.size()));
  std::nth_element(depths_m.begin(), depths_m.begin() + nth, depths_m.end());
  return {static_cast<double>(depths_m[static_cast<std::size_t>(nth)]),
          static_cast<double>(summary.farthest_m)};
}

/// kColours of them, from far to near, without the dark ends that hide the image.
cv::Mat colours() {
  constexpr int kFirst = 28, kLast = 244;
  cv::Mat ramp(1, kColours, CV_8UC1), result;
  for (int i = 0; i < kColours; ++i) {
    ramp.at<std::uint8_t>(i) =
        static_cast<std::uint8_t>(kFirst + i * (kLast - kFirst) / (kColours - 1));
  }
  cv::applyColorMap(ramp, result, cv::COLORMAP_TURBO);
  return result;
}

cv::Vec3b shaded(const cv::Vec3b& colour, double shade) {
  return {cv::saturate_cast<std::uint8_t>(shade * colour[0]),
          cv::saturate_cast<std::uint8_t>(shade * colour[1]),
          cv::saturate_cast<std::uint8_t>(shade * colour[2])};
}

cv::Mat paint(const cv::Mat& image, const DepthView& depth, const InverseScale& scale) {
  cv::Mat grey = image;
  if (image.channels() == 3) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  cv::Mat picture;
  cv::cvtColor(kUnfilledShade * grey, picture, cv::COLOR_GRAY2BGR);
  const cv::Mat palette = colours();
  for_each_depth(depth, [&](int u, int v, float z_m) {
    const int index = static_cast<int>(std::lround((kColours - 1) * scale.share(z_m)));
    const double brightness = grey.at<std::uint8_t>(v, u) / 255.0;
    picture.at<cv::Vec3b>(v, u) =
        shaded(palette.at<cv::Vec3b>(index), kDarkestShade + (1.0 - kDarkestShade) * brightness);
  });
  return picture;
}

/// Text with its left end, middle or right end at x.
enum class Anchor { kLeft, kMiddle, kRight };

class Strip {
 public:
  Strip(int width_px, double text_scale)
      : scale_(text_scale),
        line_px_(static_cast<int>(std::lround(40.0 * text_scale))),
        picture_(7 * line_px_ / 2, width_px, CV_8UC3, kPaper) {}

  /// Of the scale: a bar, from near on the left to far on the right, and its ticks.
  void draw(const InverseScale& scale) {
    const cv::Mat palette = colours();
    const int left = 2 * line_px_ + text_width("depth in m"), right = picture_.cols - 2 * line_px_;
    const int top = line_px_ / 3, bottom = top + 2 * line_px_ / 3;
    write("depth in m", left - line_px_, bottom - line_px_ / 8, Anchor::kRight);
    const int span = std::max(1, right - left);
    for (int x = left; x <= right; ++x) {
      const double share = 1.0 - static_cast<double>(x - left) / span;
      const auto index = static_cast<int>(std::lround((kColours - 1) * share));
      cv::line(picture_, {x, top}, {x, bottom}, cv::Scalar(palette.at<cv::Vec3b>(index)));
    }
    draw_ticks(scale, left, span, bottom);
  }

  void write_caption(const std::string& text) {
    const double fits = static_cast<double>(picture_.cols - 2 * line_px_) / text_width(text);
    const double normal = scale_;
    scale_ *= std::min(1.0, fits);
    write(text, line_px_, picture_.rows - line_px_ / 2, Anchor::kLeft);
    scale_ = normal;
  }

  [[nodiscard]] const cv::Mat& picture() const { return picture_; }

 private:
  [[nodiscard]] int text_width(const std::string& text) const {
    return cv::getTextSize(text, kFont, scale_, 1, nullptr).width;
  }

  void write(const std::string& text, int x, int y, Anchor anchor) {
    const int width = text_width(text);
    if (anchor == Anchor::kMiddle) x -= width / 2;
    if (anchor == Anchor::kRight) x -= width;
    cv::putText(picture_, text, {x, y}, kFont, scale_, kInk, 1, cv::LINE_AA);
  }

  /// Labels both ends, and what has room between them.
  void draw_ticks(const InverseScale& scale, int left, int span, int top) {
    int free_from = 0, free_to = picture_.cols;
    const auto draw_tick = [&](double z_m) {
      const int x = left + static_cast<int>(std::lround((1.0 - scale.share(z_m)) * span));
      const std::string text = number(z_m);
      const int half = text_width(text) / 2 + line_px_ / 4;
      if (x - half < free_from || x + half > free_to) return;
      cv::line(picture_, {x, top}, {x, top + line_px_ / 4}, kInk, 1, cv::LINE_AA);
      write(text, x, top + line_px_, Anchor::kMiddle);
      (z_m == scale.far_m ? free_to : free_from) = z_m == scale.far_m ? x - half : x + half;
    };
    draw_tick(scale.far_m);
    for (const double z_m : ticks(scale)) draw_tick(z_m);
  }

  /// The near end, and the round numbers up to the far one, in order.
  static std::vector<double> ticks(const InverseScale& scale) {
    std::vector<double> result = {scale.near_m};
    for (double decade = 0.01; decade < 1e4; decade *= 10.0) {
      for (const double step : {1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0}) {
        const double z_m = step * decade;
        if (z_m > scale.near_m && z_m < scale.far_m) result.push_back(z_m);
      }
    }
    return result;
  }

  static std::string number(double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3g", value);
    return text.data();
  }

  double scale_;
  int line_px_;
  cv::Mat picture_;
};

}  // namespace

DepthSummary summarise(const DepthView& depth) {
  DepthSummary summary;
  std::size_t filled = 0;
  for_each_depth(depth, [&](int, int, float z_m) {
    summary.nearest_m = filled == 0 ? z_m : std::min(summary.nearest_m, z_m);
    summary.farthest_m = std::max(summary.farthest_m, z_m);
    ++filled;
  });
  const double pixels = static_cast<double>(depth.width_px) * depth.height_px;
  if (pixels > 0.0) summary.filled_share = static_cast<double>(filled) / pixels;
  return summary;
}

std::string describe(const FrameLabel& label, const DepthSummary& summary) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  std::array<char, 200> text{};
  const int used = std::snprintf(text.data(),
                                 text.size(),
                                 "frame %llu    stamp %lld.%09lld s    ",
                                 static_cast<unsigned long long>(label.frame_id),
                                 static_cast<long long>(label.stamp_ns / kSecond_ns),
                                 static_cast<long long>(label.stamp_ns % kSecond_ns));
  const auto rest = static_cast<std::size_t>(used);
  if (summary.filled_share > 0.0) {
    std::snprintf(text.data() + rest,
                  text.size() - rest,
                  "depth in %.1f %% of the pixels, %.2f to %.1f m",
                  100.0 * summary.filled_share,
                  static_cast<double>(summary.nearest_m),
                  static_cast<double>(summary.farthest_m));
  } else {
    std::snprintf(text.data() + rest, text.size() - rest, "no depth");
  }
  return text.data();
}

cv::Mat draw_overlay(const cv::Mat& image, const DepthView& depth, const FrameLabel& label) {
  const bool fits = image.cols == depth.width_px && image.rows == depth.height_px &&
                    (image.type() == CV_8UC1 || image.type() == CV_8UC3) && !image.empty();
  if (!fits) throw std::logic_error("depth overlay: image and depth must have the same size");
  const auto summary = summarise(depth);
  const bool any = summary.filled_share > 0.0;
  const auto scale = any ? scale_of(depth, summary) : InverseScale{};
  cv::Mat picture = paint(image, depth, scale);
  const int times = (kLeastWidth_px + image.cols - 1) / image.cols;
  cv::resize(picture, picture, {}, times, times, cv::INTER_NEAREST);
  Strip strip(picture.cols, std::clamp(picture.cols / 2400.0, 0.4, 0.6));
  if (any) strip.draw(scale);
  strip.write_caption(describe(label, summary));
  cv::vconcat(picture, strip.picture(), picture);
  return picture;
}

}  // namespace camvox::depth
