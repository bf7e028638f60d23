#pragma once

#include <png.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <vector>

namespace camvox::import {

/// Writes a grey PNG of 16 bits a pixel, or of 8 bits (the low bytes of the pixels).
inline void write_grey_png(const std::filesystem::path& path,
                           int width,
                           int height,
                           const std::vector<std::uint16_t>& pixels,
                           int bits = 16) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_IHDR(png,
               info,
               static_cast<png_uint_32>(width),
               static_cast<png_uint_32>(height),
               bits,
               PNG_COLOR_TYPE_GRAY,
               PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  std::vector<png_byte> row;
  for (int v = 0; v < height; ++v) {
    row.clear();
    for (int u = 0; u < width; ++u) {
      const auto value = pixels[static_cast<std::size_t>(v * width + u)];
      if (bits == 16) row.push_back(static_cast<png_byte>(value >> 8));  // big-endian
      row.push_back(static_cast<png_byte>(value & 0xff));
    }
    png_write_row(png, row.data());
  }
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  std::fclose(file);
}

}  // namespace camvox::import
