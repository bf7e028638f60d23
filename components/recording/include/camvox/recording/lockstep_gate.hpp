#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace camvox::recording {

/// Holds frames back until the components that must see every one have finished the earlier ones.
/// Frames are told apart by the capture stamp of their image, so that a frame which sync had to
/// leave out does not stop the rest. A report is in the time of the stamps sent, and may be later
/// than the stamp of its image by less than the time between two. Thread-safe.
class LockstepGate {
 public:
  /// At most `frames_in_flight` images may be under way; more than one, because a scan after the
  /// image completes its frame only when the next image is almost due.
  LockstepGate(std::vector<std::string> components, std::size_t frames_in_flight);

  /// True if the next image may be sent.
  [[nodiscard]] bool may_send() const;
  /// Components that have not finished the newest frame that another one has. Images that the first
  /// of them holds, as their scan has not come, do not count: at the end none comes any more.
  [[nodiscard]] std::vector<std::string> behind() const;
  /// Components that have not finished the oldest image under way.
  [[nodiscard]] std::vector<std::string> waits_for() const;
  /// An image is under way; the same one again does not count, as sync makes one frame of both.
  void sent(std::int64_t stamp_ns);
  /// Nothing comes of the image, and nobody else hears of it.
  void left_out(std::int64_t stamp_ns);
  /// `component` has finished all frames up to the stamp and this one; 0: the image of that stamp
  /// was left out. Frames of components not waited for are ignored.
  void done(const std::string& component, std::int64_t stamp_ns, std::uint64_t frame_id);

 private:
  struct Done {
    std::int64_t stamp_ns = std::numeric_limits<std::int64_t>::min();
    std::uint64_t frame_id = 0;
  };

  void release();

  mutable std::mutex mutex_;
  std::map<std::string, Done> done_;
  std::deque<std::int64_t> in_flight_;
  std::optional<std::int64_t> last_sent_ns_;
  std::size_t frames_in_flight_;
};

}  // namespace camvox::recording
