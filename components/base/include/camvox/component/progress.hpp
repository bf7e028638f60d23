#pragma once

#include "camvox/component/context.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"

namespace camvox {

/// Tells the others which frames a component has finished, and what processor time each took:
///
///     void on_scan(const Sample<Scan>& scan) {
///       const auto work = progress_.measure();
///       ...
///       progress_.done(scan->header());
///     }
///
/// Lockstep replay and the timing table of a run listen. For one thread, the component's.
class ProgressReporter {
 public:
  /// Port of a component that reports each frame, so that lockstep can wait for it.
  static constexpr Port kFrames{"progress", topics::kProgress};
  /// Port of one that reports keyframes only.
  static constexpr Port kKeyframes{"keyframe_progress", topics::kProgress};

  explicit ProgressReporter(Context& context, const Port& port = kFrames);

  /// Counts the processor time of this thread for the frame under way, until it ends or the frame
  /// is done.
  class Work {
   public:
    explicit Work(ProgressReporter& owner) : owner_(owner) { owner_.resume(); }
    Work(const Work&) = delete;
    Work& operator=(const Work&) = delete;
    ~Work() { owner_.pause(); }

   private:
    ProgressReporter& owner_;
  };
  [[nodiscard]] Work measure() { return Work(*this); }

  /// Processor time that another thread spent on the frame under way.
  void add(double time_s) { measured_s_ += time_s; }

  /// The frame is finished; what is measured from here on is the next one's.
  void done(const camvox_interfaces::msg::MessageHeader& header);

 private:
  void resume();
  void pause();

  std::string name_;
  Publisher<camvox_interfaces::msg::Progress> publisher_;
  double measured_s_ = 0.0;
  double resumed_at_s_ = 0.0;
  int depth_ = 0;  ///< Of nested measurements.
};

/// Processor time of the calling thread.
[[nodiscard]] double thread_processor_time_s();

}  // namespace camvox
