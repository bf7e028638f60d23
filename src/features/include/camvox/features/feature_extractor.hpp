#pragma once

#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/features/binary_descriptor.hpp"
#include "camvox/features/corner_detector.hpp"
#include "camvox/features/corner_distribution.hpp"
#include "camvox/features/feature.hpp"
#include "camvox/features/image_pyramid.hpp"
#include "camvox/features/image_view.hpp"

namespace camvox::features {

/// Tuning of FeatureExtractor. YAML keys are the field names.
struct ExtractorConfig {
  int features = 1500;        ///< At most so many per image, spread over the levels.
  int levels = 8;             ///< Of the image pyramid.
  double scale_factor = 1.2;  ///< From one level to the next.
  int corner_threshold = 20;  ///< Contrast of a corner, grey levels.
  int low_threshold = 7;      ///< The same for cells that have no corner otherwise.
  double even_share =
      0.5;  ///< Part of the features that is spread evenly; the rest are the strongest.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("features", self.features, config::at_least(1), config::at_most(4096));
    field("levels", self.levels, config::at_least(1), config::at_most(16));
    field("scale_factor", self.scale_factor, config::at_least(1.05), config::at_most(1.7));
    field("corner_threshold", self.corner_threshold, config::at_least(1), config::at_most(254));
    field("low_threshold", self.low_threshold, config::at_least(1), config::at_most(254));
    field("even_share", self.even_share, config::at_least(0.0), config::at_most(1.0));
  }
};

/// Finds and describes the features of grey images: FAST corners on a pyramid, spread evenly,
/// with orientation and a rotated binary descriptor (ORB: Rublee et al., ICCV 2011; ours differs in
/// the sampling pattern, the spread, places between pixels and exact pixel centres between levels).
/// Deterministic; keeps its memory from image to image, so one object per thread.
class FeatureExtractor {
 public:
  /// Throws config::ConfigError with all problems of `config`.
  explicit FeatureExtractor(const ExtractorConfig& config);

  /// Replaces key_points and descriptors of `features` by those of the image, coarse levels first,
  /// and empties its other lists. An image too small for a patch (39 px) has none. The image is
  /// distorted or not: key points are where they are seen. Throws std::logic_error for a view whose
  /// sides are negative, longer than 65535 px, or longer than its step.
  void extract(const ImageView& image, FrameFeatures& features);
  [[nodiscard]] FrameFeatures extract(const ImageView& image);

  /// The scale of an octave: size of its pixel in pixels of the image.
  [[nodiscard]] double scale(int octave) const { return pyramid_.scale(octave); }
  [[nodiscard]] const ExtractorConfig& config() const { return config_; }

 private:
  [[nodiscard]] int budget(int level, int left) const;
  void describe_level(int level, FrameFeatures& features) const;

  ExtractorConfig config_;
  ImagePyramid pyramid_;
  CornerDetector detector_;
  CornerDistribution distribution_;
  DescriptorExtractor descriptor_extractor_;
  std::vector<Corner> corners_;
  std::vector<Corner> chosen_;
};

}  // namespace camvox::features
