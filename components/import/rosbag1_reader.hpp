#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "camvox/storage/byte_io.hpp"
#include "camvox/storage/compression.hpp"
#include "camvox/storage/source.hpp"

namespace camvox::import {

/// A publisher's topic in a ROS 1 bag.
struct Rosbag1Connection {
  std::uint32_t id = 0;
  std::string topic;
  std::string type;        ///< "sensor_msgs/Imu".
  std::string definition;  ///< With dependencies.
  bool latching = false;
};

struct Rosbag1Message {
  const Rosbag1Connection* connection = nullptr;
  std::int64_t time_ns = 0;
  storage::Bytes data;  ///< Valid until the next call of the reader.
};

/// Reads a ROS 1 bag front to back, without its index, so that a bag that was not closed can be
/// read as well. Every length is checked before it is used; what is wrong ends the import with an
/// error that names the file and the byte.
class Rosbag1Reader {
 public:
  explicit Rosbag1Reader(const std::filesystem::path& path);

  /// The next message, or nullptr at the end.
  [[nodiscard]] const Rosbag1Message* next();

  [[nodiscard]] std::uint64_t size() const { return source_->size(); }
  [[nodiscard]] std::uint64_t position() const { return position_; }
  /// Whether the recorder ended well: it then wrote an index.
  [[nodiscard]] bool closed() const { return closed_; }

 private:
  using Fields = std::map<std::string, storage::Bytes>;
  struct Record {
    Fields header;
    storage::Bytes data;
  };

  [[nodiscard]] storage::Bytes view(std::uint64_t offset, std::uint64_t size);
  [[nodiscard]] Record read_from_file();
  [[nodiscard]] Record read_from_chunk();
  [[nodiscard]] Fields parse_fields(storage::Bytes header) const;
  [[nodiscard]] bool handle(const Record& record, bool in_chunk);
  void open_bag(const Record& record);
  void open_chunk(const Record& record);
  void add_connection(const Record& record);
  void set_message(const Record& record);
  [[nodiscard]] std::string text(const Fields& fields, const std::string& name) const;
  template <typename T>
  [[nodiscard]] T number(const Fields& fields, const std::string& name) const;
  [[noreturn]] void fail(const std::string& what) const;

  std::filesystem::path path_;
  std::unique_ptr<storage::FileSource> source_;
  std::uint64_t position_ = 0;
  std::uint64_t record_begin_ = 0;  ///< Of the record in the file that is being read.
  storage::ByteBuffer header_scratch_;
  storage::ByteBuffer data_scratch_;
  storage::ByteBuffer chunk_;
  std::optional<storage::ByteReader> chunk_reader_;
  storage::Decompressor decompressor_;
  std::map<std::uint32_t, Rosbag1Connection> connections_;
  Rosbag1Message message_;
  bool closed_ = false;
  bool opened_ = false;
};

/// Replaces `out` by the decompressed bz2 input, which must be exactly `size` bytes; false if it is
/// not, or broken. Takes memory only as the data come, so that a forged size costs nothing.
[[nodiscard]] bool decompress_bz2(storage::Bytes in, std::uint64_t size, storage::ByteBuffer& out);

}  // namespace camvox::import
