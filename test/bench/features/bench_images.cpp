#include "bench_images.hpp"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "camvox/simulation/simulator.hpp"

namespace camvox::bench {

namespace fs = std::filesystem;

ImageSet load_images(const std::string& name,
                     const fs::path& folder,
                     int features,
                     std::size_t stride,
                     std::size_t count) {
  ImageSet set{name, features, {}};
  if (!fs::is_directory(folder)) return set;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".jpg") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (std::size_t i = 0; i < files.size() && set.images.size() < count; i += stride) {
    set.images.push_back(cv::imread(files[i].string(), cv::IMREAD_GRAYSCALE));
  }
  return set;
}

ImageSet render_images(std::size_t count) {
  ImageSet set{"synthetic 1520x568", 1500, {}};
  simulation::Simulator simulator(simulation::preset("loop_400m"), 2);
  while (set.images.size() < count) {
    auto event = simulator.next();
    if (!event) break;
    auto* frame = std::get_if<simulation::SimulatedFrame>(&event->message);
    if (frame == nullptr) continue;
    const cv::Mat colour(
        frame->image.height_px, frame->image.width_px, CV_8UC3, frame->image.rgb.data());
    cv::Mat grey;
    cv::cvtColor(colour, grey, cv::COLOR_RGB2GRAY);
    set.images.push_back(grey);
  }
  return set;
}

std::vector<ImageSet> image_sets(std::size_t stride, std::size_t count) {
  const fs::path data(SHARED_DATA);
  std::vector<ImageSet> sets;
  sets.push_back(load_images("RedKitchen 640x480", data / "redkitchen", 1000, stride, count));
  sets.push_back(load_images("KITTI 1242x375",
                             data / "kitti_0013/2011_09_26_drive_0013_sync/image_02/data",
                             2000,
                             stride,
                             count));
  sets.push_back(render_images(std::min<std::size_t>(count, 12)));
  std::erase_if(sets, [](const ImageSet& set) { return set.images.empty(); });
  return sets;
}

}  // namespace camvox::bench
