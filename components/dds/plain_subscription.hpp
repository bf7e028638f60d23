#pragma once

#include <memory>
#include <string>

#include "endpoints.hpp"

namespace camvox::dds {

/// Set while a reader has no room for the next sample because too many are held; who gives one back
/// then wakes the executor.
struct Starvation {
  std::atomic<bool> starved = false;
  std::function<void()> wake;
};

/// One reader of plain messages in place: of this container's pool, or of memory shared with
/// another process.
class PlainSource {
 public:
  PlainSource(std::shared_ptr<ReaderHandle> reader,
              const MessageType& type,
              bool from_this_process,
              std::shared_ptr<AtomicStats> stats)
      : reader_(std::move(reader)),
        type_(type),
        from_this_process_(from_this_process),
        stats_(std::move(stats)) {}

  /// Hands the next message on; false when there is none. Messages that break the rules (of a
  /// foreign writer, over capacity) are counted and skipped.
  bool take_one(const Context::Callback& callback);
  [[nodiscard]] const ReaderHandle& reader() const { return *reader_; }
  /// Called when delivery can go on after starvation; set before the first take.
  void set_waker(std::function<void()> wake) { starvation_->wake = std::move(wake); }

 private:
  std::shared_ptr<ReaderHandle> reader_;
  const MessageType& type_;
  bool from_this_process_;
  std::shared_ptr<AtomicStats> stats_;
  std::shared_ptr<Starvation> starvation_ = std::make_shared<Starvation>();
  SequenceTracker tracker_;
};

/// Reads plain messages that this container's components publish (`in_place`), and those of other
/// processes through shared memory (`shared`, only with interprocess zero copy).
class PlainSubscription final : public SubscriptionBackend {
 public:
  PlainSubscription(const std::shared_ptr<Participant>& participant,
                    const std::string& topic,
                    const MessageType& type,
                    const SubscribeOptions& options);
  /// Also reads the topic from memory shared with other processes.
  void add_shared(const std::shared_ptr<Participant>& participant,
                  const std::string& topic,
                  const SubscribeOptions& options);

  /// Adds what was lost or rejected at this container's border to the stats; before anybody asks
  /// for them.
  void also_count(std::shared_ptr<const AtomicStats> border) { border_stats_ = std::move(border); }

  /// Starts delivery on the executor.
  void attach(Executor& executor,
              const std::shared_ptr<Tenant>& tenant,
              const Context::Callback& callback);

  [[nodiscard]] SubscriptionStats stats() const override;
  [[nodiscard]] std::size_t publisher_count() const override;

 private:
  const MessageType& type_;
  std::shared_ptr<AtomicStats> stats_ = std::make_shared<AtomicStats>();
  std::shared_ptr<const AtomicStats> border_stats_ = std::make_shared<AtomicStats>();
  std::shared_ptr<PlainSource> in_place_;
  std::shared_ptr<PlainSource> shared_;
};

}  // namespace camvox::dds
