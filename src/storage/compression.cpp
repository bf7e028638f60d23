#include "camvox/storage/compression.hpp"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <new>
#include <string>

namespace camvox::storage {
namespace {

/// Most bytes that one compressed byte can stand for. LZ4: a length byte of 255. Zstd: a block of
/// 128 KiB from 4 bytes (3 of head, 1 repeated).
constexpr std::uint64_t kMaxLz4Ratio = 256;
constexpr std::uint64_t kMaxZstdRatio = 32 * 1024;
/// A first block may be whole although the ratio above would not allow for it.
constexpr std::uint64_t kRatioSlack = 128 * 1024;
/// Prefixes grow by this much at a time, so that memory follows the data, not the declared size.
constexpr std::size_t kPrefixStep = 1024 * 1024;

Status corrupt(const std::string& what) {
  return {StatusCode::kCorrupt, "compressed chunk cannot be read: " + what};
}

Status check_size(Compression compression, Bytes in, std::uint64_t size, std::uint64_t max_size) {
  if (size > max_size) {
    return {StatusCode::kLimit,
            "chunk declares " + std::to_string(size) + " bytes, the limit is " +
                std::to_string(max_size) + "; raise the limit if the file is trusted"};
  }
  const std::uint64_t ratio = compression == Compression::kLz4 ? kMaxLz4Ratio : kMaxZstdRatio;
  if (size > in.size() * ratio + kRatioSlack) {
    return corrupt(std::to_string(in.size()) + " bytes cannot hold the declared " +
                   std::to_string(size));
  }
  return {};
}

}  // namespace

std::string_view to_string(Compression compression) {
  switch (compression) {
    case Compression::kNone:
      return "";
    case Compression::kLz4:
      return "lz4";
    case Compression::kZstd:
      return "zstd";
  }
  return "";
}

std::optional<Compression> parse_compression(std::string_view name) {
  for (const auto compression : {Compression::kNone, Compression::kLz4, Compression::kZstd}) {
    if (to_string(compression) == name) return compression;
  }
  return std::nullopt;
}

struct Compressor::State {
  Compression compression;
  LZ4F_preferences_t lz4_preferences{};
  ZSTD_CCtx* zstd = nullptr;

  State(Compression method, int level) : compression(method) {
    lz4_preferences.compressionLevel = level;
    lz4_preferences.frameInfo.blockSizeID = LZ4F_max4MB;
    if (compression == Compression::kZstd) {
      zstd = ZSTD_createCCtx();
      if (zstd == nullptr) throw std::bad_alloc();
      ZSTD_CCtx_setParameter(zstd, ZSTD_c_compressionLevel, level);
    }
  }
  ~State() { ZSTD_freeCCtx(zstd); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
};

Compressor::Compressor(Compression compression, int level)
    : state_(std::make_unique<State>(compression, level)) {}
Compressor::~Compressor() = default;
Compressor::Compressor(Compressor&&) noexcept = default;
Compressor& Compressor::operator=(Compressor&&) noexcept = default;

Status Compressor::compress(Bytes in, ByteBuffer& out) {
  out.clear();
  if (state_->compression == Compression::kNone) {
    out.append(in);
    return {};
  }
  const bool lz4 = state_->compression == Compression::kLz4;
  state_->lz4_preferences.frameInfo.contentSize = in.size();
  out.resize(lz4 ? LZ4F_compressFrameBound(in.size(), &state_->lz4_preferences)
                 : ZSTD_compressBound(in.size()));
  const std::size_t size =
      lz4 ? LZ4F_compressFrame(
                out.data(), out.size(), in.data(), in.size(), &state_->lz4_preferences)
          : ZSTD_compress2(state_->zstd, out.data(), out.size(), in.data(), in.size());
  if (lz4 ? LZ4F_isError(size) != 0 : ZSTD_isError(size) != 0) {
    return {StatusCode::kInvalid,
            std::string("chunk cannot be compressed: ") +
                (lz4 ? LZ4F_getErrorName(size) : ZSTD_getErrorName(size))};
  }
  out.resize(size);
  return {};
}

struct Decompressor::State {
  LZ4F_dctx* lz4 = nullptr;
  ZSTD_DCtx* zstd = nullptr;

  State() {
    zstd = ZSTD_createDCtx();
    if (LZ4F_isError(LZ4F_createDecompressionContext(&lz4, LZ4F_VERSION)) != 0 || zstd == nullptr) {
      free_all();
      throw std::bad_alloc();
    }
  }
  ~State() { free_all(); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void free_all() {
    LZ4F_freeDecompressionContext(lz4);
    ZSTD_freeDCtx(zstd);
  }

  /// Decompresses into [filled, out.size()); true while input and room are left and all is well.
  /// `consumed` and `filled` move on.
  [[nodiscard]] bool step_lz4(
      Bytes in, std::size_t& consumed, ByteBuffer& out, std::size_t& filled, std::string& error) {
    std::size_t room = out.size() - filled;
    std::size_t used = in.size() - consumed;
    const std::size_t hint =
        LZ4F_decompress(lz4, out.data() + filled, &room, in.data() + consumed, &used, nullptr);
    if (LZ4F_isError(hint) != 0) {
      error = LZ4F_getErrorName(hint);
      return false;
    }
    consumed += used;
    filled += room;
    return hint != 0 && (used != 0 || room != 0);
  }

  [[nodiscard]] bool step_zstd(Bytes in,
                               std::size_t& consumed,
                               ByteBuffer& out,
                               std::size_t& filled) {
    ZSTD_inBuffer source{in.data(), in.size(), consumed};
    ZSTD_outBuffer target{out.data(), out.size(), filled};
    const std::size_t hint = ZSTD_decompressStream(zstd, &target, &source);
    const bool moved = source.pos != consumed || target.pos != filled;
    consumed = source.pos;
    filled = target.pos;
    return ZSTD_isError(hint) == 0 && hint != 0 && moved;
  }

  Status decompress_lz4(Bytes in, ByteBuffer& out) {
    LZ4F_resetDecompressionContext(lz4);
    std::size_t consumed = 0;
    std::size_t filled = 0;
    std::string error;
    while (step_lz4(in, consumed, out, filled, error)) {
    }
    if (!error.empty()) return corrupt(error);
    if (filled != out.size() || consumed != in.size()) {
      return corrupt("lz4 frame does not hold exactly the declared " + std::to_string(out.size()) +
                     " bytes");
    }
    return {};
  }

  Status decompress_zstd(Bytes in, ByteBuffer& out) {
    const std::size_t size =
        ZSTD_decompressDCtx(zstd, out.data(), out.size(), in.data(), in.size());
    if (ZSTD_isError(size) != 0) return corrupt(ZSTD_getErrorName(size));
    if (size != out.size()) {
      return corrupt("zstd frame holds " + std::to_string(size) + " bytes, " +
                     std::to_string(out.size()) + " declared");
    }
    return {};
  }
};

Decompressor::Decompressor() = default;
Decompressor::~Decompressor() = default;
Decompressor::Decompressor(Decompressor&&) noexcept = default;
Decompressor& Decompressor::operator=(Decompressor&&) noexcept = default;

Status Decompressor::decompress(Compression compression,
                                Bytes in,
                                std::uint64_t size,
                                std::uint64_t max_size,
                                ByteBuffer& out) {
  out.clear();
  if (compression == Compression::kNone) {
    if (size != in.size()) return corrupt("uncompressed chunk of another size than declared");
    out.append(in);
    return {};
  }
  if (auto status = check_size(compression, in, size, max_size); !status.ok()) return status;
  if (compression == Compression::kZstd) {
    const auto declared = ZSTD_getFrameContentSize(in.data(), in.size());
    if (declared == ZSTD_CONTENTSIZE_ERROR) return corrupt("not a zstd frame");
    // More than one frame may follow each other, so the first may only be smaller.
    if (declared != ZSTD_CONTENTSIZE_UNKNOWN && declared > size) {
      return corrupt("zstd frame declares " + std::to_string(declared) + " bytes, the chunk " +
                     std::to_string(size));
    }
  }
  if (!state_) state_ = std::make_unique<State>();
  out.resize(static_cast<std::size_t>(size));
  auto status = compression == Compression::kLz4 ? state_->decompress_lz4(in, out)
                                                 : state_->decompress_zstd(in, out);
  if (!status.ok()) out.clear();
  return status;
}

void Decompressor::decompress_prefix(Compression compression,
                                     Bytes in,
                                     std::uint64_t size,
                                     ByteBuffer& out) {
  out.clear();
  if (compression == Compression::kNone) {
    out.append(in.first(static_cast<std::size_t>(std::min<std::uint64_t>(in.size(), size))));
    return;
  }
  if (!state_) state_ = std::make_unique<State>();
  LZ4F_resetDecompressionContext(state_->lz4);
  ZSTD_DCtx_reset(state_->zstd, ZSTD_reset_session_only);
  std::size_t consumed = 0;
  std::size_t filled = 0;
  std::string error;
  bool more = true;
  while (more && filled < size) {
    out.resize(static_cast<std::size_t>(std::min<std::uint64_t>(size, filled + kPrefixStep)));
    more = compression == Compression::kLz4 ? state_->step_lz4(in, consumed, out, filled, error)
                                            : state_->step_zstd(in, consumed, out, filled);
  }
  out.resize(filled);
}

}  // namespace camvox::storage
