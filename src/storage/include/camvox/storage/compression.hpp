#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include "camvox/storage/byte_buffer.hpp"
#include "camvox/storage/status.hpp"

namespace camvox::storage {

enum class Compression { kNone, kLz4, kZstd };

/// Name in a chunk record: "", "lz4" (LZ4 frame format) or "zstd".
[[nodiscard]] std::string_view to_string(Compression compression);
[[nodiscard]] std::optional<Compression> parse_compression(std::string_view name);

/// Compresses chunks one after the other; keeps its working memory. Same input, same output.
class Compressor {
 public:
  /// `level`: 0 is the library's default; lz4 -1 (fast) to 12, zstd -7 (fast) to 22 (small).
  Compressor(Compression compression, int level);
  ~Compressor();
  Compressor(Compressor&&) noexcept;
  Compressor& operator=(Compressor&&) noexcept;

  /// Replaces `out` by the compressed input. kNone copies.
  Status compress(Bytes in, ByteBuffer& out);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Decompresses chunks one after the other; keeps its working memory.
class Decompressor {
 public:
  Decompressor();
  ~Decompressor();
  Decompressor(Decompressor&&) noexcept;
  Decompressor& operator=(Decompressor&&) noexcept;

  /// Replaces `out` by the decompressed input, which must be exactly `size` bytes. Before anything
  /// is allocated, `size` is checked against `max_size`, against what the input can possibly hold
  /// (the best ratio of each format), and against the size that a zstd frame itself declares; a
  /// forged chunk can therefore not make the reader take more memory than `max_size`.
  Status decompress(Compression compression,
                    Bytes in,
                    std::uint64_t size,
                    std::uint64_t max_size,
                    ByteBuffer& out);

  /// What a cut-off input still holds: replaces `out` by the decompressed prefix, at most `size`
  /// bytes of it. Never fails; a damaged input gives what came before the damage.
  void decompress_prefix(Compression compression, Bytes in, std::uint64_t size, ByteBuffer& out);

 private:
  struct State;
  std::unique_ptr<State> state_;  ///< Made for the first chunk that is compressed.
};

}  // namespace camvox::storage
