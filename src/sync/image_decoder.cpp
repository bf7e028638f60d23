#include "camvox/sync/image_decoder.hpp"

#include <png.h>
#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <opencv2/imgproc.hpp>

namespace camvox::sync {
namespace {

int even(int size) { return size + (size & 1); }

std::string wrong_size(int width_px, int height_px, const ImageTarget& target) {
  return "is " + std::to_string(width_px) + "x" + std::to_string(height_px) + ", the camera has " +
         std::to_string(target.width_px) + "x" + std::to_string(target.height_px);
}

std::string problem(int width_px, int height_px, const ImageTarget& target) {
  if (width_px != target.width_px || height_px != target.height_px) {
    return wrong_size(width_px, height_px, target);
  }
  const std::size_t needed = image_bytes(width_px, height_px, target.format);
  if (needed <= target.data.size()) return {};
  return "needs " + std::to_string(needed) + " bytes, a frame image holds " +
         std::to_string(target.data.size());
}

/// The pixels of an interleaved target, or the Y plane.
cv::Mat view(const ImageTarget& target) {
  const int type = target.format == PixelFormat::kBgr8 ? CV_8UC3 : CV_8UC1;
  return {target.height_px,
          target.width_px,
          type,
          target.data.data(),
          row_step_bytes(target.width_px, target.format)};
}

/// U and V, full range ITU-R BT.601 as in JPEG: of the mean of each 2x2 block; clamped at the
/// border.
void write_chroma(const cv::Mat& bgr, const ImageTarget& target) {
  cv::Mat whole = bgr, half, luma_v_u;
  if (bgr.rows % 2 != 0 || bgr.cols % 2 != 0) {
    cv::copyMakeBorder(bgr, whole, 0, bgr.rows % 2, 0, bgr.cols % 2, cv::BORDER_REPLICATE);
  }
  cv::resize(whole, half, whole.size() / 2, 0.0, 0.0, cv::INTER_AREA);
  cv::cvtColor(half, luma_v_u, cv::COLOR_BGR2YCrCb);
  std::uint8_t* planes = target.data.data() + row_step_bytes(bgr.cols, target.format) *
                                                  static_cast<std::size_t>(whole.rows);
  cv::extractChannel(luma_v_u, cv::Mat(half.size(), CV_8UC1, planes), 2);
  cv::extractChannel(luma_v_u, cv::Mat(half.size(), CV_8UC1, planes + half.total()), 1);
}

/// An image in some colour order, to grey and to BGR by OpenCV's conversions; < 0: as it is.
struct Encoding {
  std::string_view name;
  int channels;
  int to_grey;
  int to_bgr;
};
constexpr int kAsIs = -1;
constexpr std::array<Encoding, 14> kEncodings = {{
    {"mono8", 1, kAsIs, cv::COLOR_GRAY2BGR},
    {"8UC1", 1, kAsIs, cv::COLOR_GRAY2BGR},
    {"bgr8", 3, cv::COLOR_BGR2GRAY, kAsIs},
    {"8UC3", 3, cv::COLOR_BGR2GRAY, kAsIs},
    {"rgb8", 3, cv::COLOR_RGB2GRAY, cv::COLOR_RGB2BGR},
    {"bgra8", 4, cv::COLOR_BGRA2GRAY, cv::COLOR_BGRA2BGR},
    {"rgba8", 4, cv::COLOR_RGBA2GRAY, cv::COLOR_RGBA2BGR},
    // OpenCV names a Bayer pattern by its second row.
    {"bayer_rggb8", 1, cv::COLOR_BayerBG2GRAY, cv::COLOR_BayerBG2BGR},
    {"bayer_bggr8", 1, cv::COLOR_BayerRG2GRAY, cv::COLOR_BayerRG2BGR},
    {"bayer_gbrg8", 1, cv::COLOR_BayerGR2GRAY, cv::COLOR_BayerGR2BGR},
    {"bayer_grbg8", 1, cv::COLOR_BayerGB2GRAY, cv::COLOR_BayerGB2BGR},
    {"yuv422", 2, cv::COLOR_YUV2GRAY_UYVY, cv::COLOR_YUV2BGR_UYVY},
    {"uyvy", 2, cv::COLOR_YUV2GRAY_UYVY, cv::COLOR_YUV2BGR_UYVY},
    {"yuv422_yuy2", 2, cv::COLOR_YUV2GRAY_YUY2, cv::COLOR_YUV2BGR_YUY2},
}};

void convert_one(const cv::Mat& from, int code, cv::Mat to) {
  if (code == kAsIs) {
    from.copyTo(to);
  } else {
    cv::cvtColor(from, to, code);
  }
}

void write_pixels(const cv::Mat& from, const Encoding& encoding, const ImageTarget& target) {
  if (target.format == PixelFormat::kMono8)
    return convert_one(from, encoding.to_grey, view(target));
  if (target.format == PixelFormat::kBgr8) return convert_one(from, encoding.to_bgr, view(target));
  cv::Mat bgr = from;
  if (encoding.to_bgr != kAsIs) cv::cvtColor(from, bgr, encoding.to_bgr);
  cv::cvtColor(bgr, view(target), cv::COLOR_BGR2GRAY);
  write_chroma(bgr, target);
}

}  // namespace

std::size_t row_step_bytes(int width_px, PixelFormat format) {
  if (format == PixelFormat::kBgr8) return static_cast<std::size_t>(width_px) * 3;
  return static_cast<std::size_t>(format == PixelFormat::kYuv420 ? even(width_px) : width_px);
}

std::size_t image_bytes(int width_px, int height_px, PixelFormat format) {
  const std::size_t step = row_step_bytes(width_px, format);
  if (format != PixelFormat::kYuv420) return step * static_cast<std::size_t>(height_px);
  return step * static_cast<std::size_t>(even(height_px)) * 3 / 2;
}

ImageDecoder::ImageDecoder() : jpeg_(tjInitDecompress()) {
  if (jpeg_ == nullptr) throw std::bad_alloc();
}

ImageDecoder::~ImageDecoder() { tjDestroy(jpeg_); }

std::string ImageDecoder::decode(std::span<const std::uint8_t> bytes, const ImageTarget& target) {
  constexpr std::array<std::uint8_t, 2> kJpeg = {0xff, 0xd8};
  constexpr std::array<std::uint8_t, 4> kPng = {0x89, 'P', 'N', 'G'};
  const auto starts_with = [&](const auto& magic) {
    return bytes.size() >= magic.size() && std::ranges::equal(bytes.first(magic.size()), magic);
  };
  if (starts_with(kJpeg)) return decode_jpeg(bytes, target);
  if (starts_with(kPng)) return decode_png(bytes, target);
  return "is neither JPEG nor PNG";
}

std::string ImageDecoder::decode_jpeg(std::span<const std::uint8_t> bytes,
                                      const ImageTarget& target) {
  int width_px = 0, height_px = 0, subsampling = 0, colour_space = 0;
  if (tjDecompressHeader3(
          jpeg_, bytes.data(), bytes.size(), &width_px, &height_px, &subsampling, &colour_space) !=
      0) {
    return tjGetErrorStr2(jpeg_);
  }
  if (auto wrong = problem(width_px, height_px, target); !wrong.empty()) return wrong;
  const int step = static_cast<int>(row_step_bytes(width_px, target.format));
  auto* const data = target.data.data();
  int status = 0;
  if (target.format == PixelFormat::kYuv420 && subsampling == TJSAMP_420) {
    const int half = even(width_px) / 2;
    unsigned char* const u = data + step * even(height_px);
    unsigned char* planes[3] = {data, u, u + half * (even(height_px) / 2)};
    int strides[3] = {step, half, half};
    status = tjDecompressToYUVPlanes(
        jpeg_, bytes.data(), bytes.size(), planes, width_px, strides, height_px, 0);
  } else if (target.format == PixelFormat::kYuv420) {
    scratch_.resize(image_bytes(width_px, height_px, PixelFormat::kBgr8));
    const ImageTarget bgr{scratch_, width_px, height_px, PixelFormat::kBgr8};
    if (auto wrong = decode_jpeg(bytes, bgr); !wrong.empty()) return wrong;
    write_pixels(view(bgr), kEncodings[2], target);
  } else {
    const int format = target.format == PixelFormat::kMono8 ? TJPF_GRAY : TJPF_BGR;
    status = tjDecompress2(
        jpeg_, bytes.data(), bytes.size(), data, width_px, step, height_px, format, 0);
  }
  // A damaged file still gives an image, with grey blocks: not something to track on.
  return status == 0 ? std::string() : std::string(tjGetErrorStr2(jpeg_));
}

std::string ImageDecoder::decode_png(std::span<const std::uint8_t> bytes,
                                     const ImageTarget& target) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0) {
    return image.message;
  }
  const int width_px = static_cast<int>(image.width), height_px = static_cast<int>(image.height);
  if (auto wrong = problem(width_px, height_px, target); !wrong.empty()) {
    png_image_free(&image);
    return wrong;
  }
  const bool colour = (image.format & PNG_FORMAT_FLAG_COLOR) != 0;
  image.format = colour ? PNG_FORMAT_BGR : PNG_FORMAT_GRAY;
  const auto own_format = colour ? PixelFormat::kBgr8 : PixelFormat::kMono8;
  const bool direct = own_format == target.format;
  if (!direct) scratch_.resize(image_bytes(width_px, height_px, own_format));
  const ImageTarget decoded{
      direct ? target.data : std::span(scratch_), width_px, height_px, own_format};
  if (png_image_finish_read(&image, nullptr, decoded.data.data(), 0, nullptr) == 0) {
    return image.message;
  }
  if (!direct) write_pixels(view(decoded), kEncodings[colour ? 2 : 0], target);
  return {};
}

std::string ImageDecoder::convert(const RawImage& image, const ImageTarget& target) {
  const auto* encoding = std::ranges::find(kEncodings, image.encoding, &Encoding::name);
  if (encoding == kEncodings.end()) {
    return "has encoding '" + std::string(image.encoding) + "', which is not supported";
  }
  if (auto wrong = problem(image.width_px, image.height_px, target); !wrong.empty()) return wrong;
  const std::size_t row_bytes =
      static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(encoding->channels);
  const auto rows = static_cast<std::size_t>(image.height_px);
  if (image.row_step_bytes < row_bytes ||
      image.data.size() < image.row_step_bytes * (rows - 1) + row_bytes) {
    return "has fewer bytes than its size says";
  }
  if (encoding->channels == 2 && image.width_px % 2 != 0) return "has yuv422 rows of odd length";
  const cv::Mat from(image.height_px,
                     image.width_px,
                     CV_8UC(encoding->channels),
                     const_cast<std::uint8_t*>(image.data.data()),
                     image.row_step_bytes);
  write_pixels(from, *encoding, target);
  return {};
}

}  // namespace camvox::sync
