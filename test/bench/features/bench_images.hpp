#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace camvox::bench {

/// Grey images of one source and the number of features that is usual there.
struct ImageSet {
  std::string name;
  int features;
  std::vector<cv::Mat> images;
};

/// Every `stride`-th JPEG of a folder, in order of names, at most `count`.
ImageSet load_images(const std::string& name,
                     const std::filesystem::path& folder,
                     int features,
                     std::size_t stride,
                     std::size_t count);

/// What the synthetic camera of 1520x568 sees in the world "loop_400m".
ImageSet render_images(std::size_t count);

/// RedKitchen (1 000 features), KITTI (2 000) and the synthetic camera (1 500); what is not there
/// is left out.
std::vector<ImageSet> image_sets(std::size_t stride, std::size_t count);

}  // namespace camvox::bench
