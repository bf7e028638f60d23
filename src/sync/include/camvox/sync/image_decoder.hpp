#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace camvox::sync {

/// How an image lies in memory.
enum class PixelFormat : std::uint8_t {
  kMono8,
  kBgr8,
  /// Y plane, then U, then V; U and V of half the size each way. Rows and columns are made even.
  /// Full range, as in JPEG, so that the Y plane is just what kMono8 would be.
  kYuv420,
};

/// Where to put an image, and what it must be.
struct ImageTarget {
  std::span<std::uint8_t> data;
  int width_px = 0;
  int height_px = 0;
  PixelFormat format = PixelFormat::kMono8;
};

/// Bytes from one row of an image to the next; of the Y plane if there are planes.
[[nodiscard]] std::size_t row_step_bytes(int width_px, PixelFormat format);
/// Bytes of an image.
[[nodiscard]] std::size_t image_bytes(int width_px, int height_px, PixelFormat format);

/// An uncompressed image as sensor_msgs/Image has it.
struct RawImage {
  std::string_view
      encoding;  ///< mono8, bgr8, rgb8, bgra8, rgba8, bayer_*8, yuv422 (UYVY), yuv422_yuy2
  int width_px = 0;
  int height_px = 0;
  std::size_t row_step_bytes = 0;
  std::span<const std::uint8_t> data;
};

/// Brings images of all usual encodings into the form that the pipeline works on, in one pass from
/// the message into the loaned memory. A grey image is decoded from the Y plane of a JPEG alone,
/// without chroma and colour conversion. Keeps a decompressor and scratch memory: one per thread.
class ImageDecoder {
 public:
  ImageDecoder();
  ~ImageDecoder();
  ImageDecoder(const ImageDecoder&) = delete;
  ImageDecoder& operator=(const ImageDecoder&) = delete;

  /// Decodes a JPEG or PNG. Returns what is wrong, or "": then the target holds the image.
  [[nodiscard]] std::string decode(std::span<const std::uint8_t> bytes, const ImageTarget& target);
  /// Copies or converts an uncompressed image. Returns what is wrong, or "".
  [[nodiscard]] std::string convert(const RawImage& image, const ImageTarget& target);

 private:
  [[nodiscard]] std::string decode_jpeg(std::span<const std::uint8_t> bytes,
                                        const ImageTarget& target);
  [[nodiscard]] std::string decode_png(std::span<const std::uint8_t> bytes,
                                       const ImageTarget& target);

  void* jpeg_;
  std::vector<std::uint8_t> scratch_;
};

}  // namespace camvox::sync
