#include "camvox/storage/crc.hpp"

#include <isa-l/crc.h>
#include <zlib.h>

namespace camvox::storage {

std::uint32_t crc32(Bytes bytes, std::uint32_t crc) {
  if (bytes.empty()) return crc;
  return crc32_gzip_refl(crc, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}

std::uint32_t crc32_combine(std::uint32_t crc_a, std::uint32_t crc_b, std::uint64_t size_b) {
  return static_cast<std::uint32_t>(
      ::crc32_combine64(crc_a, crc_b, static_cast<z_off64_t>(size_b)));
}

}  // namespace camvox::storage
