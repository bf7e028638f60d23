#include "camvox/storage/sink.hpp"

#include <fcntl.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace camvox::storage {
namespace {

constexpr std::size_t kMaxParts = 16;

/// Drops the first `written` bytes of the list.
std::span<iovec> advance(std::span<iovec> parts, std::size_t written) {
  while (!parts.empty() && written >= parts.front().iov_len) {
    written -= parts.front().iov_len;
    parts = parts.subspan(1);
  }
  if (!parts.empty()) {
    parts.front().iov_base = static_cast<char*>(parts.front().iov_base) + written;
    parts.front().iov_len -= written;
  }
  return parts;
}

}  // namespace

Result<std::unique_ptr<FileSink>> FileSink::create(const std::filesystem::path& path,
                                                   Durability durability) {
  const int descriptor =
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);  // NOLINT
  if (descriptor < 0) {
    return Status(StatusCode::kIo, path.string() + ": cannot be created: " + std::strerror(errno));
  }
  return std::unique_ptr<FileSink>(new FileSink(descriptor, path, durability));
}

FileSink::FileSink(int descriptor, std::filesystem::path path, Durability durability)
    : descriptor_(descriptor), path_(std::move(path)), durability_(durability) {}

FileSink::~FileSink() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Status FileSink::failed(const char* action, int error) const {
  std::string message = path_.string() + ": " + action + " failed: " + std::strerror(error);
  if (error == ENOSPC) message += "; free some space";
  return {StatusCode::kIo, message};
}

Status FileSink::write(std::span<const Bytes> parts) {
  if (descriptor_ < 0) return {StatusCode::kInvalid, path_.string() + ": is closed"};
  std::array<iovec, kMaxParts> storage;
  while (!parts.empty()) {
    std::size_t count = 0;
    for (; count < std::min(parts.size(), kMaxParts); ++count) {
      storage[count] = {const_cast<std::byte*>(parts[count].data()), parts[count].size()};
    }
    parts = parts.subspan(count);
    auto left = advance({storage.data(), count}, 0);
    while (!left.empty()) {
      const ssize_t written = ::writev(descriptor_, left.data(), static_cast<int>(left.size()));
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return failed("write", written < 0 ? errno : ENOSPC);
      left = advance(left, static_cast<std::size_t>(written));
    }
  }
  return {};
}

Status FileSink::flush() {
  if (durability_ == Durability::kProcessCrash || descriptor_ < 0) return {};
  // Pipes and devices cannot be synchronised and need not be.
  if (::fdatasync(descriptor_) != 0 && errno != EINVAL && errno != EROFS) {
    return failed("flush", errno);
  }
  return {};
}

Status FileSink::close() {
  if (descriptor_ < 0) return {};
  Status status = flush();
  const int result = ::close(descriptor_);
  const int error = errno;
  descriptor_ = -1;
  if (status.ok() && result != 0) return failed("close", error);
  return status;
}

Status MemorySink::write(std::span<const Bytes> parts) {
  for (const Bytes part : parts) out_.append(part);
  return {};
}

}  // namespace camvox::storage
