#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "camvox/storage/byte_buffer.hpp"
#include "camvox/storage/status.hpp"

namespace camvox::storage {

/// Bytes that a reader can look at in any order. Safe to use from several threads.
class Source {
 public:
  Source() = default;
  virtual ~Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  [[nodiscard]] virtual std::uint64_t size() const = 0;

  /// Whether `view` costs nothing, because all bytes are in memory already.
  [[nodiscard]] virtual bool in_memory() const = 0;

  /// The bytes [offset, offset + size): in place when they are in memory, else read into `scratch`,
  /// behind its first `keep` bytes. kTruncated when the source is shorter.
  virtual Result<Bytes> view(std::uint64_t offset,
                             std::uint64_t size,
                             ByteBuffer& scratch,
                             std::size_t keep = 0) const = 0;
};

/// Bytes of the caller, who keeps them alive.
class MemorySource final : public Source {
 public:
  explicit MemorySource(Bytes bytes) : bytes_(bytes) {}

  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }
  [[nodiscard]] bool in_memory() const override { return true; }
  Result<Bytes> view(std::uint64_t offset,
                     std::uint64_t size,
                     ByteBuffer& scratch,
                     std::size_t keep = 0) const override;

 private:
  Bytes bytes_;
};

/// A file, read with pread. Not mapped: a mapped file that another program cuts short, or a bad
/// sector, kills the process; here both are a Status.
class FileSource final : public Source {
 public:
  static Result<std::unique_ptr<FileSource>> open(const std::filesystem::path& path);
  ~FileSource() override;

  [[nodiscard]] std::uint64_t size() const override { return size_; }
  [[nodiscard]] bool in_memory() const override { return false; }
  Result<Bytes> view(std::uint64_t offset,
                     std::uint64_t size,
                     ByteBuffer& scratch,
                     std::size_t keep = 0) const override;

 private:
  FileSource(int descriptor, std::uint64_t size, std::filesystem::path path);

  int descriptor_;
  std::uint64_t size_;
  std::filesystem::path path_;
};

/// Moves through a source front to back in large reads, giving out small views.
class SourceWindow {
 public:
  explicit SourceWindow(const Source& source) : source_(&source) {}

  [[nodiscard]] std::uint64_t source_size() const { return source_->size(); }

  /// The bytes [offset, offset + size), valid until the next call.
  Result<Bytes> view(std::uint64_t offset, std::uint64_t size);

 private:
  const Source* source_;
  ByteBuffer buffer_;
  std::uint64_t begin_ = 0;  ///< Where in the source the buffer starts.
};

}  // namespace camvox::storage
