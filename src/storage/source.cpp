#include "camvox/storage/source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace camvox::storage {
namespace {

constexpr std::uint64_t kWindowSize = 64 * 1024;

Status beyond_end(std::uint64_t offset, std::uint64_t size, std::uint64_t source_size) {
  return {StatusCode::kTruncated,
          std::to_string(size) + " bytes at offset " + std::to_string(offset) +
              " are beyond the end at " + std::to_string(source_size)};
}

}  // namespace

Result<Bytes> MemorySource::view(std::uint64_t offset,
                                 std::uint64_t size,
                                 ByteBuffer& /*scratch*/,
                                 std::size_t /*keep*/) const {
  if (offset > bytes_.size() || size > bytes_.size() - offset) {
    return beyond_end(offset, size, bytes_.size());
  }
  return bytes_.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(size));
}

Result<std::unique_ptr<FileSource>> FileSource::open(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);  // NOLINT
  if (descriptor < 0) {
    return Status(StatusCode::kIo, path.string() + ": cannot be opened: " + std::strerror(errno));
  }
  struct stat info {};
  if (::fstat(descriptor, &info) != 0 || !S_ISREG(info.st_mode)) {
    ::close(descriptor);
    return Status(StatusCode::kIo, path.string() + ": is not a regular file");
  }
  const auto size = static_cast<std::uint64_t>(info.st_size);
  return std::unique_ptr<FileSource>(new FileSource(descriptor, size, path));
}

FileSource::FileSource(int descriptor, std::uint64_t size, std::filesystem::path path)
    : descriptor_(descriptor), size_(size), path_(std::move(path)) {}

FileSource::~FileSource() { ::close(descriptor_); }

Result<Bytes> FileSource::view(std::uint64_t offset,
                               std::uint64_t size,
                               ByteBuffer& scratch,
                               std::size_t keep) const {
  if (offset > size_ || size > size_ - offset) return beyond_end(offset, size, size_);
  scratch.resize(keep + static_cast<std::size_t>(size));
  std::size_t done = 0;
  while (done < size) {
    const ssize_t got = ::pread(descriptor_,
                                scratch.data() + keep + done,
                                static_cast<std::size_t>(size) - done,
                                static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      return Status(StatusCode::kIo, path_.string() + ": read failed: " + std::strerror(errno));
    }
    if (got == 0) return beyond_end(offset, size, offset + done);
    done += static_cast<std::size_t>(got);
  }
  return scratch.view().subspan(keep);
}

Result<Bytes> SourceWindow::view(std::uint64_t offset, std::uint64_t size) {
  if (source_->in_memory()) return source_->view(offset, size, buffer_);
  const std::uint64_t source_size = source_->size();
  if (offset > source_size || size > source_size - offset) {
    return beyond_end(offset, size, source_size);
  }
  const std::uint64_t end = begin_ + buffer_.size();
  const bool inside = offset >= begin_ && offset <= end;
  if (!inside || size > end - offset) {
    const std::size_t kept = inside ? static_cast<std::size_t>(end - offset) : 0;
    if (kept > 0) std::memmove(buffer_.data(), buffer_.data() + (offset - begin_), kept);
    const std::uint64_t wanted = std::min(std::max(size, kWindowSize), source_size - offset);
    buffer_.resize(kept);
    begin_ = offset;
    auto read = source_->view(offset + kept, wanted - kept, buffer_, kept);
    if (!read.ok()) {
      buffer_.clear();
      return read.status();
    }
  }
  return buffer_.view().subspan(static_cast<std::size_t>(offset - begin_),
                                static_cast<std::size_t>(size));
}

}  // namespace camvox::storage
