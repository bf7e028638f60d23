#include "camvox/simulation/jpeg.hpp"

#include <turbojpeg.h>

#include <memory>
#include <stdexcept>
#include <string>

namespace camvox::simulation {

std::vector<std::uint8_t> encode_jpeg(const ColorImage& image, int quality) {
  if (quality < 1 || quality > 100) throw std::logic_error("encode_jpeg: quality must be 1 to 100");
  if (image.rgb.empty()) throw std::logic_error("encode_jpeg: empty image");
  const auto close = [](tjhandle handle) { tjDestroy(handle); };
  const std::unique_ptr<void, decltype(close)> compressor(tjInitCompress(), close);
  std::vector<std::uint8_t> jpeg(tjBufSize(image.width_px, image.height_px, TJSAMP_420));
  unsigned char* output = jpeg.data();
  unsigned long size = jpeg.size();
  const int status = tjCompress2(compressor.get(),
                                 image.rgb.data(),
                                 image.width_px,
                                 0,
                                 image.height_px,
                                 TJPF_RGB,
                                 &output,
                                 &size,
                                 TJSAMP_420,
                                 quality,
                                 TJFLAG_NOREALLOC | TJFLAG_FASTDCT);
  if (status != 0) {
    throw std::runtime_error(std::string("encode_jpeg: ") + tjGetErrorStr2(compressor.get()));
  }
  jpeg.resize(size);
  return jpeg;
}

}  // namespace camvox::simulation
