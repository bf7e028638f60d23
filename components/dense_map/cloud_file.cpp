#include "cloud_file.hpp"

#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace camvox::dense_map {
namespace {

pcl::PointCloud<pcl::PointXYZRGB> to_pcl(const std::vector<dense::ColouredPoint>& points) {
  pcl::PointCloud<pcl::PointXYZRGB> cloud;
  cloud.reserve(points.size());
  for (const auto& [p, rgb] : points) {
    cloud.push_back(pcl::PointXYZRGB(p.x(), p.y(), p.z(), rgb[0], rgb[1], rgb[2]));
  }
  return cloud;
}

/// `write` gets a temporary name with the same extension. What is shorter than `min_bytes` is not
/// whole.
template <typename Write>
std::string save(const std::filesystem::path& file, std::uintmax_t min_bytes, Write&& write) {
  auto temporary = file;
  temporary.replace_filename("." + file.filename().string() + ".part" + file.extension().string());
  bool written = false;
  std::string why;
  try {
    written = write(temporary.string());
  } catch (const std::exception& error) {
    why = std::string(": ") + error.what();
  }
  std::error_code error;
  // PCL does not notice a full disk when it writes PLY.
  if (written && std::filesystem::file_size(temporary, error) < min_bytes) {
    written = false;
    why = ": the file is cut short; is the disk full?";
  }
  if (written) std::filesystem::rename(temporary, file, error);
  if (written && !error) return {};
  std::filesystem::remove(temporary, error);
  return file.string() + ": cannot be written" + why;
}

}  // namespace

std::string save_pcd(const std::filesystem::path& file,
                     const std::vector<dense::ColouredPoint>& points) {
  return save(file, 1, [&](const std::string& name) {
    return pcl::io::savePCDFileBinaryCompressed(name, to_pcl(points)) == 0;
  });
}

std::string save_ply(const std::filesystem::path& file,
                     const std::vector<dense::ColouredPoint>& points) {
  constexpr std::uintmax_t kPointBytes = 15;  // x y z as float, three colours
  return save(file, kPointBytes * points.size(), [&](const std::string& name) {
    return pcl::io::savePLYFileBinary(name, to_pcl(points)) == 0;
  });
}

std::string save_png(const std::filesystem::path& file, const dense::Picture& picture) {
  return save(file, 1, [&](const std::string& name) {
    const cv::Mat rgb(picture.height_px,
                      picture.width_px,
                      CV_8UC3,
                      const_cast<std::uint8_t*>(picture.rgb.data()));
    cv::Mat bgr;
    cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
    return cv::imwrite(name, bgr);
  });
}

}  // namespace camvox::dense_map
