#include "image_file.hpp"

#include <png.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "import_error.hpp"
#include "text_file.hpp"

namespace camvox::import {
namespace {

constexpr int kMaxSide_px = 1 << 15;
constexpr std::array<std::uint8_t, 8> kPngMagic = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::array<std::uint8_t, 8> kPngEnd = {'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82};

int big_endian16(const std::uint8_t* bytes) { return bytes[0] << 8 | bytes[1]; }

bool read_png_head(EncodedImage& image) {
  const auto& bytes = image.bytes;
  if (bytes.size() < 33 || !std::equal(kPngMagic.begin(), kPngMagic.end(), bytes.begin()) ||
      !std::equal(kPngEnd.begin(), kPngEnd.end(), bytes.end() - kPngEnd.size())) {
    return false;
  }
  if (big_endian16(&bytes[16]) != 0 || big_endian16(&bytes[20]) != 0) return false;
  image.format = "png";
  image.width_px = big_endian16(&bytes[18]);
  image.height_px = big_endian16(&bytes[22]);
  return true;
}

/// Whether a JPEG marker begins a frame header: SOF0 to SOF15 without DHT, JPG and DAC (ITU T.81,
/// table B.1).
bool is_frame_header(std::uint8_t marker) {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

bool read_jpeg_head(EncodedImage& image) {
  const auto& bytes = image.bytes;
  if (bytes.size() < 4 || bytes[0] != 0xff || bytes[1] != 0xd8) return false;
  // Some cameras pad behind the end marker.
  auto end = bytes.size();
  while (end > 2 && bytes[end - 1] == 0) --end;
  if (bytes[end - 2] != 0xff || bytes[end - 1] != 0xd9) return false;
  for (std::size_t at = 2; at + 9 < bytes.size() && bytes[at] == 0xff;) {
    const auto marker = bytes[at + 1];
    if (is_frame_header(marker)) {
      image.format = "jpeg";
      image.height_px = big_endian16(&bytes[at + 5]);
      image.width_px = big_endian16(&bytes[at + 7]);
      return true;
    }
    at += marker == 0xff ? 1 : 2 + static_cast<std::size_t>(big_endian16(&bytes[at + 2]));
  }
  return false;
}

/// libpng's side of reading: bytes from memory, errors as the text for the exception.
struct PngReader {
  const std::vector<std::uint8_t>& bytes;
  std::size_t position = 0;
  std::string error;
};

void png_take(png_structp png, png_bytep to, std::size_t size) {
  auto& reader = *static_cast<PngReader*>(png_get_io_ptr(png));
  if (size > reader.bytes.size() - reader.position) png_error(png, "the file is cut off");
  std::memcpy(to, reader.bytes.data() + reader.position, size);
  reader.position += size;
}

[[noreturn]] void png_fail(png_structp png, png_const_charp what) {
  static_cast<PngReader*>(png_get_error_ptr(png))->error = what;
  png_longjmp(png, 1);
}

void png_ignore(png_structp /*png*/, png_const_charp /*what*/) {}

/// The part between setjmp and the jump: nothing here has a destructor that a jump would skip.
bool decode(png_structp png, png_infop info, GreyImage16& image) {
  if (setjmp(png_jmpbuf(png))) return false;  // NOLINT: libpng reports errors so
  png_set_user_limits(png, kMaxSide_px, kMaxSide_px);
  png_read_info(png, info);
  if (png_get_bit_depth(png, info) != 16 || png_get_color_type(png, info) != PNG_COLOR_TYPE_GRAY) {
    png_error(png, "is not a 16-bit grey image");
  }
  if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, info);
  image.width_px = static_cast<int>(png_get_image_width(png, info));
  image.height_px = static_cast<int>(png_get_image_height(png, info));
  const auto width = static_cast<std::size_t>(image.width_px);
  image.pixels.resize(width * static_cast<std::size_t>(image.height_px));
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t row = 0; row < static_cast<std::size_t>(image.height_px); ++row) {
      png_read_row(png, reinterpret_cast<png_bytep>(&image.pixels[row * width]), nullptr);
    }
  }
  png_read_end(png, nullptr);
  return true;
}

}  // namespace

EncodedImage read_encoded_image(const std::filesystem::path& path) {
  EncodedImage image;
  image.bytes = read_bytes(path);
  if (!read_png_head(image) && !read_jpeg_head(image)) {
    fail_corrupt(path, "is no complete JPEG or PNG image");
  }
  if (image.width_px == 0 || image.height_px == 0) fail_corrupt(path, "is an empty image");
  return image;
}

GreyImage16 read_png16(const std::filesystem::path& path) {
  const auto bytes = read_bytes(path);
  if (bytes.size() < 8 || !std::equal(kPngMagic.begin(), kPngMagic.end(), bytes.begin())) {
    fail_corrupt(path, "is no PNG image");
  }
  PngReader reader{bytes, 0, {}};
  GreyImage16 image;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader, png_fail, png_ignore);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  if (info == nullptr) throw std::bad_alloc();
  png_set_read_fn(png, &reader, png_take);
  const bool whole = decode(png, info, image);
  png_destroy_read_struct(&png, &info, nullptr);
  if (!whole) fail_corrupt(path, reader.error);
  return image;
}

}  // namespace camvox::import
