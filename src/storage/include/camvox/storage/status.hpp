#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace camvox::storage {

/// Why an operation on a recording did not succeed.
enum class StatusCode {
  kOk,
  kIo,           ///< The operating system refused: disk full, no such file, permission.
  kTruncated,    ///< The data end inside a record, or before the closing magic.
  kBadMagic,     ///< Not an MCAP file.
  kCorrupt,      ///< A record contradicts the format or another record.
  kCrcMismatch,  ///< The bytes are not those that were written.
  kLimit,        ///< A declared size is over the limit that the caller set.
  kUnsupported,  ///< Valid, but not something this library reads (unknown compression).
  kInvalid,      ///< The caller asked for something that cannot be done.
};

[[nodiscard]] std::string_view to_string(StatusCode code);

/// Outcome of an operation on a file: success, or a code and a sentence that says what, where, and
/// what to do.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(StatusCode code, std::string message) : code_(code), message_(std::move(message)) {}

  [[nodiscard]] bool ok() const { return code_ == StatusCode::kOk; }
  [[nodiscard]] StatusCode code() const { return code_; }
  [[nodiscard]] const std::string& message() const { return message_; }

 private:
  StatusCode code_ = StatusCode::kOk;
  std::string message_;
};

/// A value, or the Status that says why there is none. Reading the value of a failed result throws
/// std::logic_error: it is a bug of the caller.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : value_(std::move(value)) {}         // NOLINT: implicit on purpose
  Result(Status status) : status_(std::move(status)) {  // NOLINT: implicit on purpose
    if (status_.ok()) throw std::logic_error("Result without a value needs an error");
  }

  [[nodiscard]] bool ok() const { return value_.has_value(); }
  [[nodiscard]] const Status& status() const { return status_; }

  [[nodiscard]] T& operator*() & { return get(); }
  [[nodiscard]] const T& operator*() const& { return const_cast<Result*>(this)->get(); }
  [[nodiscard]] T&& operator*() && { return std::move(get()); }
  [[nodiscard]] T* operator->() { return &get(); }
  [[nodiscard]] const T* operator->() const { return &const_cast<Result*>(this)->get(); }

 private:
  T& get() {
    if (!value_) throw std::logic_error("value of a failed Result: " + status_.message());
    return *value_;
  }

  Status status_;
  std::optional<T> value_;
};

}  // namespace camvox::storage
