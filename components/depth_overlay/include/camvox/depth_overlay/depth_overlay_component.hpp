#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "camvox/component/component.hpp"
#include "camvox/component/progress.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"

namespace camvox {

/// Parameters of DepthOverlayComponent.
struct DepthOverlayConfig {
  std::string output_dir;     ///< Gets depth_overlay.png, unless `file` is given.
  std::string file;           ///< The picture (.png), instead.
  std::int64_t frame_id = 0;  ///< Of the frame to draw; 0: the last.
  std::int64_t stamp_ns =
      0;  ///< Draw the frame nearest to this (at most 0.5 s off); 0: `frame_id` says which.
  bool exit_when_found = false;  ///< End the container when the frame is there.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("output_dir", self.output_dir);
    field("file", self.file);
    field("frame_id", self.frame_id, config::at_least(0));
    field("stamp_ns", self.stamp_ns, config::at_least(0));
    field("exit_when_found", self.exit_when_found);
  }
};

/// Keeps one frame's image and depth, wherever they come from (lidar, RGB-D camera), and writes
/// them at the end as a picture (see depth::draw_overlay). Nothing is copied or drawn before. The
/// last frame is the last that has depth. Lockstep waits for it, or under load it would miss
/// frames.
class DepthOverlayComponent final : public Component {
 public:
  explicit DepthOverlayComponent(Context& context);
  void stop() override;

 private:
  using FrameImage = camvox_interfaces::msg::FrameImage;
  using DepthImage = camvox_interfaces::msg::DepthImage;
  struct Parts {
    std::optional<Sample<FrameImage>> image;
    std::optional<Sample<DepthImage>> depth;
  };
  struct Frame {
    Sample<FrameImage> image;
    Sample<DepthImage> depth;
  };

  void take(std::uint64_t frame_id);
  [[nodiscard]] bool is_better(const FrameImage& candidate) const;
  [[nodiscard]] bool is_found(const FrameImage& newest) const;
  [[nodiscard]] std::string nothing_found() const;
  void write(const Frame& frame, const std::filesystem::path& file);

  Context& context_;
  DepthOverlayConfig config_;
  ProgressReporter progress_;
  std::map<std::uint64_t, Parts> frames_;  ///< Of which a part is still missing.
  std::optional<Frame> chosen_;
  std::uint64_t seen_ = 0;
};

}  // namespace camvox
