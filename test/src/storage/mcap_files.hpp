#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "camvox/storage/byte_buffer.hpp"
#include "camvox/storage/sink.hpp"
#include "camvox/storage/writer.hpp"

namespace camvox::storage {

/// Folder of MCAP files that nobody here made, beside the project.
inline std::filesystem::path recordings() {
  return std::filesystem::path(CAMVOX_PROJECT_ROOT) / ".." / "shared" / "data" / "mcap";
}

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline void write_text(const std::filesystem::path& path, std::string_view text) {
  std::ofstream(path, std::ios::binary)
      .write(text.data(), static_cast<std::ptrdiff_t>(text.size()));
}

/// All files under the folder with the extension, in a fixed order.
inline std::vector<std::filesystem::path> files_under(const std::filesystem::path& folder,
                                                      const std::string& extension) {
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::exists(folder)) return files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() == extension) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Empty folder of this name, for one test.
inline std::filesystem::path fresh_folder(const std::string& name) {
  const auto folder = std::filesystem::temp_directory_path() / ("camvox_" + name);
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

/// A message with bytes that follow from its number, so that any of them can be checked.
struct TestMessage {
  std::uint16_t channel_id = 1;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::string data;
  friend bool operator==(const TestMessage&, const TestMessage&) = default;
};

inline TestMessage copy_of(const Message& message) {
  return {message.channel_id,
          message.sequence,
          message.log_time_ns,
          std::string(as_text(message.data))};
}

inline Message view_of(const TestMessage& message) {
  return {message.channel_id,
          message.sequence,
          message.log_time_ns,
          message.log_time_ns,
          as_bytes(message.data)};
}

/// Channels 1 and 2 on /a and /b with a schema each; the messages in the order given.
inline std::string write_file(const std::vector<TestMessage>& messages,
                              const McapWriterOptions& options,
                              bool close = true) {
  ByteBuffer out;
  McapWriter writer(options);
  Status status = writer.open(std::make_unique<MemorySink>(out));
  if (status.ok()) status = writer.add_schema(Schema{1, "pkg/msg/A", "ros2msg", "int32 a"});
  if (status.ok()) status = writer.add_schema(Schema{2, "pkg/msg/B", "ros2msg", "string b"});
  if (status.ok()) status = writer.add_channel(Channel{1, 1, "/a", "cdr", {{"qos", "x"}}});
  if (status.ok()) status = writer.add_channel(Channel{2, 2, "/b", "cdr", {}});
  for (const auto& message : messages) {
    if (status.ok()) status = writer.write(view_of(message));
  }
  if (status.ok()) status = close ? writer.close() : writer.flush();
  if (!status.ok()) throw std::runtime_error(status.message());
  return std::string(as_text(out.view()));
}

/// Messages on both channels, one per 10 ns from 1000 ns on, of about `size` bytes.
inline std::vector<TestMessage> make_messages(std::uint32_t count, std::size_t size) {
  std::vector<TestMessage> messages;
  for (std::uint32_t i = 0; i < count; ++i) {
    std::string data(size + i % 7, '\0');
    for (std::size_t k = 0; k < data.size(); ++k) {
      data[k] = static_cast<char>((k / 3 + i * 31) & 0xFF);
    }
    messages.push_back({static_cast<std::uint16_t>(1 + i % 2), i, 1000 + 10ULL * i, data});
  }
  return messages;
}

}  // namespace camvox::storage
