#pragma once

#include <filesystem>
#include <memory>
#include <span>

#include "camvox/storage/byte_buffer.hpp"
#include "camvox/storage/status.hpp"

namespace camvox::storage {

/// Where a writer puts its bytes, front to back. Errors are returned, never thrown: a full disk is
/// an expected outcome of a recording.
class Sink {
 public:
  Sink() = default;
  virtual ~Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;

  /// Appends the parts in order. On an error some of the bytes may have been written.
  virtual Status write(std::span<const Bytes> parts) = 0;

  /// Called when the bytes so far are worth keeping (after each chunk).
  virtual Status flush() = 0;

  /// Ends the output; nothing may be written afterwards.
  virtual Status close() = 0;
};

/// When the bytes of a flush are safe.
enum class Durability {
  kProcessCrash,  ///< In the hands of the operating system: survives a crash of this program.
  kPowerCut,      ///< On the disk: survives a power cut; each flush waits for the disk.
};

/// A new file. Not buffered: each write goes to the operating system, which the writer's chunks
/// make large enough.
class FileSink final : public Sink {
 public:
  /// Fails when the file cannot be created; an existing one is replaced.
  static Result<std::unique_ptr<FileSink>> create(
      const std::filesystem::path& path, Durability durability = Durability::kProcessCrash);
  ~FileSink() override;

  Status write(std::span<const Bytes> parts) override;
  Status flush() override;
  Status close() override;

 private:
  FileSink(int descriptor, std::filesystem::path path, Durability durability);
  [[nodiscard]] Status failed(const char* action, int error) const;

  int descriptor_;
  std::filesystem::path path_;
  Durability durability_;
};

/// A buffer of the caller.
class MemorySink final : public Sink {
 public:
  explicit MemorySink(ByteBuffer& out) : out_(out) {}

  Status write(std::span<const Bytes> parts) override;
  Status flush() override { return {}; }
  Status close() override { return {}; }

 private:
  ByteBuffer& out_;
};

}  // namespace camvox::storage
