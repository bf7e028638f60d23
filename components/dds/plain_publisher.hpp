#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "endpoints.hpp"

namespace camvox::dds {

/// Publishes a plain message in place: to readers of this container without a copy, and, if the
/// topic is interprocess zero-copy, to other processes through shared memory.
///
/// A message is filled in shared memory when another process reads it there, else in the
/// container's pool. Readers on the other side of the choice get a copy of the used part.
class PlainPublisher final : public PublisherBackend {
 public:
  PlainPublisher(std::shared_ptr<Participant> participant,
                 const std::string& topic,
                 const MessageType& type,
                 const PublishOptions& options,
                 const TopicSettings& settings);
  ~PlainPublisher() override;

  void* loan() override;
  void publish(void* message) override { publish_as_of(message, 0); }
  /// Publishes for somebody else, who sent the message at that time (ns; 0: now).
  void publish_as_of(void* message, std::int64_t publish_stamp_ns);
  void discard(void* message) noexcept override;
  [[nodiscard]] std::size_t subscriber_count() const override;
  /// Messages that readers did not get, because they were too slow.
  [[nodiscard]] std::shared_ptr<const std::atomic<std::uint64_t>> unsent_count() const {
    return unsent_;
  }

 private:
  [[nodiscard]] bool shared_is_read() const;
  void* loan_from(WriterHandle& writer);
  void publish_shared(void* message);
  void publish_in_place(void* message, std::int64_t publish_stamp_ns);
  void copy_to(WriterHandle& writer, const void* message);

  std::string topic_;
  const MessageType& type_;
  int max_loans_;
  std::chrono::milliseconds max_blocking_;
  std::unique_ptr<WriterHandle> in_place_;
  std::unique_ptr<WriterHandle> shared_;  // only with interprocess zero copy
  std::shared_ptr<std::atomic<std::uint64_t>> unsent_ =
      std::make_shared<std::atomic<std::uint64_t>>(0);

  std::mutex mutex_;  // guards what follows; loans may be made and dropped on any thread
  std::set<void*> shared_loans_;
  std::set<void*> in_place_loans_;
  void* unsent_loan_ = nullptr;
};

}  // namespace camvox::dds
