#include "camvox/storage/record_reader.hpp"

#include "camvox/storage/crc.hpp"

namespace camvox::storage {
namespace {

std::string hex(std::uint32_t value) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text = "0x";
  for (int shift = 28; shift >= 0; shift -= 4) text += kDigits[(value >> shift) & 0xFU];
  return text;
}

std::uint64_t length_of(Bytes head) {
  std::uint64_t length = 0;
  std::memcpy(&length, head.data() + 1, sizeof(length));
  return length;
}

}  // namespace

Status check_magic(const Source& source) {
  ByteBuffer scratch;
  const auto magic = source.view(0, kMagic.size(), scratch);
  if (!magic.ok() && magic.status().code() == StatusCode::kIo) return magic.status();
  if (!magic.ok() || as_text(*magic) != kMagic) {
    return {StatusCode::kBadMagic, "offset 0: this is not an MCAP file (its first 8 bytes differ)"};
  }
  return {};
}

RecordReader::RecordReader(const Source& source, const ReadLimits& limits)
    : window_(source), limits_(limits), offset_(kMagic.size()) {}

bool RecordReader::stop(StatusCode code, const std::string& what) {
  status_ = {code, "offset " + std::to_string(offset_) + ": " + what};
  return false;
}

void RecordReader::seek(std::uint64_t offset) {
  offset_ = offset;
  behind_footer_ = false;
  status_ = {};
}

bool RecordReader::check_closing_magic() {
  const auto magic = window_.view(offset_, kMagic.size());
  if (!magic.ok()) return stop(StatusCode::kTruncated, "the closing magic is cut off");
  if (as_text(*magic) != kMagic) return stop(StatusCode::kBadMagic, "the closing magic is wrong");
  return false;
}

bool RecordReader::next(RawRecord& record) {
  if (!status_.ok()) return false;
  if (behind_footer_) return check_closing_magic();
  const std::uint64_t left = window_.source_size() - std::min(offset_, window_.source_size());
  if (left == 0) return stop(StatusCode::kTruncated, "the file ends without a footer");
  if (left < kRecordHeadSize) return stop(StatusCode::kTruncated, "a record is cut off");
  auto bytes = window_.view(offset_, kRecordHeadSize);
  if (!bytes.ok()) return stop(bytes.status().code(), bytes.status().message());
  const auto opcode = std::to_integer<std::uint8_t>((*bytes)[0]);
  const std::uint64_t length = length_of(*bytes);
  const std::string name(to_string(Opcode{opcode}));
  if (opcode == 0) return stop(StatusCode::kCorrupt, "0 is not the opcode of a record");
  if (length > left - kRecordHeadSize) {
    return stop(StatusCode::kTruncated,
                name + " of " + std::to_string(length) + " bytes is beyond the end of the file");
  }
  if (length > limits_.max_record_size) {
    return stop(StatusCode::kLimit,
                name + " of " + std::to_string(length) + " bytes is over the limit of " +
                    std::to_string(limits_.max_record_size));
  }
  bytes = window_.view(offset_, kRecordHeadSize + length);
  if (!bytes.ok()) return stop(bytes.status().code(), bytes.status().message());
  record = {opcode, offset_, (*bytes).subspan(kRecordHeadSize)};
  offset_ = record.end();
  behind_footer_ = record.is(Opcode::kFooter);
  return true;
}

bool ChunkRecords::next(RawRecord& record) {
  const std::size_t left = records_.size() - position_;
  if (left < kRecordHeadSize) return false;
  const Bytes head = records_.subspan(position_, kRecordHeadSize);
  const std::uint64_t length = length_of(head);
  if (length > left - kRecordHeadSize) return false;
  record = {std::to_integer<std::uint8_t>(head[0]),
            position_,
            records_.subspan(position_ + kRecordHeadSize, static_cast<std::size_t>(length))};
  position_ = static_cast<std::size_t>(record.end());
  return true;
}

Result<Bytes> ChunkLoader::load(const Chunk& chunk,
                                ByteBuffer& buffer,
                                std::optional<std::uint32_t> crc_in_file) {
  const auto compression = parse_compression(chunk.compression);
  if (!compression) {
    return Status(StatusCode::kUnsupported,
                  "chunk compression '" + chunk.compression + "'; known are none, lz4 and zstd");
  }
  Bytes records = chunk.records;
  if (*compression != Compression::kNone || records.size() != chunk.uncompressed_size) {
    auto status = decompressor_.decompress(
        *compression, records, chunk.uncompressed_size, limits_.max_chunk_size, buffer);
    if (!status.ok()) return status;
    records = buffer.view();
    crc_in_file.reset();
  }
  if (verify_crc_ && chunk.uncompressed_crc != 0) {
    const std::uint32_t crc = crc_in_file ? *crc_in_file : crc32(records);
    if (crc != chunk.uncompressed_crc) {
      return Status(StatusCode::kCrcMismatch,
                    "chunk CRC is " + hex(crc) + ", written as " + hex(chunk.uncompressed_crc));
    }
  }
  return records;
}

Bytes ChunkLoader::load_prefix(const Chunk& chunk, ByteBuffer& buffer) {
  const auto compression = parse_compression(chunk.compression);
  if (!compression) return {};
  const std::uint64_t size = std::min(chunk.uncompressed_size, limits_.max_chunk_size);
  decompressor_.decompress_prefix(*compression, chunk.records, size, buffer);
  return buffer.view();
}

}  // namespace camvox::storage
