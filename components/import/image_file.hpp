#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace camvox::import {

/// A JPEG or PNG file, not decoded.
struct EncodedImage {
  std::string format;  ///< "jpeg" or "png", as in CompressedImage.
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> bytes;
};

/// Reads an image file and looks at its head and end; a file that is no image, or is cut off, is
/// an error.
[[nodiscard]] EncodedImage read_encoded_image(const std::filesystem::path& path);

/// A grey image with 16 bits a pixel, rows from top to bottom.
struct GreyImage16 {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint16_t> pixels;
};

/// Decodes a PNG with 16-bit grey pixels; anything else is an error.
[[nodiscard]] GreyImage16 read_png16(const std::filesystem::path& path);

}  // namespace camvox::import
