#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "camvox/component/sample.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"

namespace camvox::tracking_component {

/// What belongs to one frame; each comes on its own topic, in any order.
struct FrameInputs {
  std::optional<Sample<camvox_interfaces::msg::FrameImage>> image;
  std::optional<Sample<camvox_interfaces::msg::DepthImage>> depth;
  std::optional<Sample<camvox_interfaces::msg::Cloud>> cloud;
};

/// Collects the inputs of frames by their id and hands them out in order. An image whose id goes
/// back while its stamp goes on begins a new sequence of ids.
class FrameQueue {
 public:
  /// At most so many frames are held; the oldest goes when one more comes.
  static constexpr std::size_t kCapacity = 5;

  FrameQueue(bool needs_cloud, bool keep_all) : needs_cloud_(needs_cloud), keep_all_(keep_all) {}

  void add(const Sample<camvox_interfaces::msg::FrameImage>& image);
  void add(const Sample<camvox_interfaces::msg::DepthImage>& depth);
  void add(const Sample<camvox_interfaces::msg::Cloud>& cloud);

  /// Id of the next frame to work on, if there is one: the oldest, once it is complete (keep_all);
  /// else the newest complete one, after older ones that lack nothing but their depth.
  [[nodiscard]] std::optional<std::uint64_t> next() const;
  /// Takes a frame out. Older ones are dropped: without an image silently, the others counted,
  /// as are images that come too late.
  [[nodiscard]] FrameInputs take(std::uint64_t frame_id);

  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

 private:
  [[nodiscard]] FrameInputs* slot(std::uint64_t frame_id);
  [[nodiscard]] bool complete(const FrameInputs& inputs) const;
  void drop_oldest();
  void begin_ids_anew();

  bool needs_cloud_;
  bool keep_all_;
  std::map<std::uint64_t, FrameInputs> frames_;
  std::uint64_t last_taken_ = 0;
  std::int64_t last_stamp_ns_ = 0;  ///< Of the image last taken.
  std::uint64_t dropped_ = 0;
};

}  // namespace camvox::tracking_component
