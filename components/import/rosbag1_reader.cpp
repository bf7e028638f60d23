#include "rosbag1_reader.hpp"

#include <bzlib.h>

#include <algorithm>
#include <limits>

#include "import_error.hpp"

namespace camvox::import {
namespace {

using storage::Bytes;
using storage::StatusCode;

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::uint32_t kMaxHeader = 1U << 20;
constexpr std::uint64_t kMaxChunk = 1U << 30;  // ROS 1 cannot send a larger message

// Op codes of records.
constexpr std::uint8_t kMessage = 0x02;
constexpr std::uint8_t kBagHeader = 0x03;
constexpr std::uint8_t kIndex = 0x04;
constexpr std::uint8_t kChunk = 0x05;
constexpr std::uint8_t kChunkInfo = 0x06;
constexpr std::uint8_t kConnection = 0x07;

}  // namespace

Rosbag1Reader::Rosbag1Reader(const std::filesystem::path& path) : path_(path) {
  if (std::filesystem::is_directory(path)) fail_corrupt(path, "is a folder, no ROS 1 bag");
  auto source = storage::FileSource::open(path);
  if (!source.ok()) throw ImportError(source.status());
  source_ = *std::move(source);
  if (size() < kMagic.size() || storage::as_text(view(0, kMagic.size())) != kMagic) {
    throw ImportError(StatusCode::kBadMagic, path.string() + ": is no ROS 1 bag of format 2.0");
  }
  position_ = kMagic.size();
}

const Rosbag1Message* Rosbag1Reader::next() {
  while (true) {
    if (chunk_reader_ && chunk_reader_->remaining() > 0) {
      if (handle(read_from_chunk(), true)) return &message_;
      continue;
    }
    chunk_reader_.reset();
    if (position_ == size()) return nullptr;
    if (handle(read_from_file(), false)) return &message_;
  }
}

Bytes Rosbag1Reader::view(std::uint64_t offset, std::uint64_t size) {
  data_scratch_.clear();
  const auto bytes = source_->view(offset, size, data_scratch_);
  if (!bytes.ok()) throw ImportError(bytes.status());
  return *bytes;
}

Rosbag1Reader::Record Rosbag1Reader::read_from_file() {
  record_begin_ = position_;
  const auto take_length = [&](const char* of, std::uint64_t most) {
    if (size() - position_ < sizeof(std::uint32_t)) fail("the file ends inside a record");
    const auto length = storage::ByteReader(view(position_, 4)).number<std::uint32_t>();
    position_ += sizeof(std::uint32_t);
    if (length > most)
      fail(std::string("a ") + of + " of " + std::to_string(length) + " bytes is too long");
    if (length > size() - position_) fail("the file ends inside a record");
    return length;
  };
  Record record;
  const auto header_length = take_length("header", kMaxHeader);
  header_scratch_.clear();
  header_scratch_.append(view(position_, header_length));
  position_ += header_length;
  record.header = parse_fields(header_scratch_.view());
  const auto data_length = take_length("record", kMaxChunk);
  record.data = view(position_, data_length);
  position_ += data_length;
  return record;
}

Rosbag1Reader::Record Rosbag1Reader::read_from_chunk() {
  Record record;
  const auto header = chunk_reader_->bytes32();
  record.data = chunk_reader_->bytes32();
  if (!chunk_reader_->ok()) fail("a record goes over the end of its chunk");
  record.header = parse_fields(header);
  return record;
}

Rosbag1Reader::Fields Rosbag1Reader::parse_fields(Bytes header) const {
  Fields fields;
  storage::ByteReader reader(header);
  while (reader.remaining() > 0) {
    const auto field = reader.bytes32();
    const auto text = storage::as_text(field);
    const auto equals = text.find('=');
    if (!reader.ok() || equals == std::string_view::npos) fail("a record has a broken header");
    fields[std::string(text.substr(0, equals))] = field.subspan(equals + 1);
  }
  return fields;
}

bool Rosbag1Reader::handle(const Record& record, bool in_chunk) {
  const auto op = number<std::uint8_t>(record.header, "op");
  if (!in_chunk && !std::exchange(opened_, true) && op != kBagHeader) fail("has no bag header");
  switch (op) {
    case kMessage:
      set_message(record);
      return true;
    case kConnection:
      add_connection(record);
      return false;
    case kBagHeader:
    case kChunk:
      if (in_chunk) fail("a chunk holds what a chunk cannot hold");
      op == kChunk ? open_chunk(record) : open_bag(record);
      return false;
    case kIndex:
    case kChunkInfo:
      return false;
    default:
      fail("unknown kind of record: " + std::to_string(op));
  }
}

void Rosbag1Reader::open_bag(const Record& record) {
  const auto encryptor = record.header.find("encryptor");
  if (encryptor != record.header.end() && !encryptor->second.empty()) {
    throw ImportError(StatusCode::kUnsupported, path_.string() + ": is encrypted");
  }
  closed_ = number<std::uint64_t>(record.header, "index_pos") != 0;
}

void Rosbag1Reader::open_chunk(const Record& record) {
  const auto compression = text(record.header, "compression");
  const std::uint64_t size = number<std::uint32_t>(record.header, "size");
  if (size > kMaxChunk) fail("a chunk of " + std::to_string(size) + " bytes is too long");
  if (compression == "none") {
    chunk_.clear();
    chunk_.append(record.data);
  } else if (compression == "bz2") {
    if (!decompress_bz2(record.data, size, chunk_)) fail("a bz2 chunk is broken");
  } else if (compression == "lz4") {  // roslz4 writes the LZ4 frame format
    const auto status =
        decompressor_.decompress(storage::Compression::kLz4, record.data, size, kMaxChunk, chunk_);
    if (!status.ok()) fail("an lz4 chunk is broken: " + status.message());
  } else {
    throw ImportError(StatusCode::kUnsupported,
                      path_.string() + ": chunks are compressed with '" +
                          compression.substr(0, 20) + "', which is not known");
  }
  chunk_reader_.emplace(chunk_.view());
}

void Rosbag1Reader::add_connection(const Record& record) {
  const auto id = number<std::uint32_t>(record.header, "conn");
  if (connections_.contains(id)) return;  // comes in its chunk and again at the end
  const auto fields = parse_fields(record.data);
  Rosbag1Connection connection;
  connection.id = id;
  connection.topic = text(record.header, "topic");
  connection.type = text(fields, "type");
  connection.definition = text(fields, "message_definition");
  connection.latching = fields.contains("latching") && text(fields, "latching") == "1";
  connections_[id] = std::move(connection);
}

void Rosbag1Reader::set_message(const Record& record) {
  const auto found = connections_.find(number<std::uint32_t>(record.header, "conn"));
  if (found == connections_.end()) fail("a message comes before its connection");
  const auto time = number<std::uint64_t>(record.header, "time");  // seconds, then nanoseconds
  constexpr std::uint64_t kHalf = 32;
  const auto seconds = static_cast<std::int64_t>(time & std::numeric_limits<std::uint32_t>::max());
  message_ = {&found->second,
              seconds * 1'000'000'000 + static_cast<std::int64_t>(time >> kHalf),
              record.data};
}

std::string Rosbag1Reader::text(const Fields& fields, const std::string& name) const {
  const auto found = fields.find(name);
  if (found == fields.end()) fail("a record has no field '" + name + "'");
  return std::string(storage::as_text(found->second));
}

template <typename T>
T Rosbag1Reader::number(const Fields& fields, const std::string& name) const {
  const auto found = fields.find(name);
  if (found == fields.end() || found->second.size() != sizeof(T)) {
    fail("a record has no field '" + name + "' of " + std::to_string(sizeof(T)) + " bytes");
  }
  return storage::ByteReader(found->second).number<T>();
}

void Rosbag1Reader::fail(const std::string& what) const {
  fail_corrupt(path_, "record at byte " + std::to_string(record_begin_) + ": " + what);
}

bool decompress_bz2(Bytes in, std::uint64_t size, storage::ByteBuffer& out) {
  constexpr std::size_t kFirst = 1U << 20;
  out.clear();
  bz_stream stream{};
  stream.next_in = const_cast<char*>(reinterpret_cast<const char*>(in.data()));  // C interface
  stream.avail_in = static_cast<unsigned>(in.size());
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw std::bad_alloc();
  std::size_t filled = 0;
  int result = BZ_OK;
  while (result == BZ_OK) {
    // One byte more than due shows that there is too much.
    out.resize(std::min<std::uint64_t>(size + 1, std::max(kFirst, 2 * filled)));
    stream.next_out = reinterpret_cast<char*>(out.data()) + filled;
    stream.avail_out = static_cast<unsigned>(out.size() - filled);
    result = BZ2_bzDecompress(&stream);
    const auto before = std::exchange(filled, out.size() - stream.avail_out);
    if (result == BZ_OK && (filled > size || (stream.avail_in == 0 && filled == before))) break;
  }
  BZ2_bzDecompressEnd(&stream);
  out.resize(std::min<std::uint64_t>(filled, size));
  return result == BZ_STREAM_END && filled == size;
}

}  // namespace camvox::import
