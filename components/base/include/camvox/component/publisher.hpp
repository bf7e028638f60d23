#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace camvox {

/// No free sample: the component holds more loans than it asked for, or readers hold them all.
/// Nothing was lost; the loan can be tried again once one has been published or dropped.
class LoanError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a middleware does for a publisher; components use Publisher<T>.
class PublisherBackend {
 public:
  PublisherBackend() = default;
  PublisherBackend(const PublisherBackend&) = delete;
  PublisherBackend& operator=(const PublisherBackend&) = delete;
  virtual ~PublisherBackend() = default;

  /// A cleared message to fill; throws LoanError when the pool is empty.
  virtual void* loan() = 0;
  /// Sends a loaned message, which is no longer the caller's. Never blocks longer than the
  /// topic's configured bound; a message that could not be sent by then is counted.
  virtual void publish(void* message) = 0;
  /// Gives a loaned message back unsent.
  virtual void discard(void* message) noexcept = 0;
  [[nodiscard]] virtual std::size_t subscriber_count() const = 0;
  /// Waits until all reliable readers have everything that was published; false at the timeout.
  [[nodiscard]] virtual bool wait_for_acknowledgments(std::chrono::nanoseconds) { return true; }
};

/// A message on loan: filled in place, then published; dropped if it is not.
template <typename T>
class Loan {
 public:
  Loan(std::shared_ptr<PublisherBackend> owner, T* message)
      : owner_(std::move(owner)), message_(message) {}
  Loan(Loan&& other) noexcept
      : owner_(std::move(other.owner_)), message_(std::exchange(other.message_, nullptr)) {}
  Loan& operator=(Loan&& other) noexcept {
    std::swap(owner_, other.owner_);
    std::swap(message_, other.message_);
    return *this;
  }
  Loan(const Loan&) = delete;
  Loan& operator=(const Loan&) = delete;
  ~Loan() {
    if (message_ != nullptr) owner_->discard(message_);
  }

  T& operator*() { return *message_; }
  T* operator->() { return message_; }
  [[nodiscard]] T* release() { return std::exchange(message_, nullptr); }

 private:
  std::shared_ptr<PublisherBackend> owner_;
  T* message_;
};

/// Sends messages of one type on one topic:
///
///     auto sample = publisher.loan();
///     sample->width_px() = 640;
///     publisher.publish(std::move(sample));
///
/// All scalars and counters of a new loan are zero; list rows are not cleared, because only the
/// counted ones are ever read. Copies of a publisher share its endpoint.
template <typename T>
class Publisher {
 public:
  Publisher() = default;  ///< Belongs to no topic; assign one from Context::advertise.
  explicit Publisher(std::shared_ptr<PublisherBackend> backend) : backend_(std::move(backend)) {}

  /// Throws LoanError when no sample is free.
  [[nodiscard]] Loan<T> loan() { return {backend_, static_cast<T*>(backend_->loan())}; }
  void publish(Loan<T>&& loan) { backend_->publish(loan.release()); }
  /// Sends a copy. For small messages; large ones are filled in place.
  void publish(const T& message) {
    auto copy = loan();
    *copy = message;
    publish(std::move(copy));
  }
  [[nodiscard]] std::size_t subscriber_count() const { return backend_->subscriber_count(); }
  /// Waits until all reliable readers have everything that was published; false at the timeout.
  [[nodiscard]] bool wait_for_acknowledgments(std::chrono::nanoseconds timeout) const {
    return backend_->wait_for_acknowledgments(timeout);
  }

 private:
  std::shared_ptr<PublisherBackend> backend_;
};

}  // namespace camvox
