#include "camvox/depth_overlay/depth_overlay_component.hpp"

#include <algorithm>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <utility>
#include <vector>

#include "camvox/conversion/cv_image.hpp"
#include "camvox/depth/overlay.hpp"

namespace camvox {
namespace {

/// A part that lacks its other longer than this many frames will not get it any more.
constexpr std::size_t kFramesKept = 4;
constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kNear_ns = kSecond_ns / 2;

}  // namespace

DepthOverlayComponent::DepthOverlayComponent(Context& context)
    : context_(context), config_(context.parameters<DepthOverlayConfig>()), progress_(context) {
  const SubscribeOptions frames{.qos = qos::kFrames, .max_held = kFramesKept + 2};
  context.subscribe<FrameImage>(
      {"frame_image", topics::kFrameImage},
      [this](const auto& image) {
        const auto work = progress_.measure();
        frames_[image->header().frame_id()].image = image;
        take(image->header().frame_id());
      },
      frames);
  context.subscribe<DepthImage>(
      {"depth_image", topics::kDepthImage},
      [this](const auto& depth) {
        const auto work = progress_.measure();
        frames_[depth->header().frame_id()].depth = depth;
        take(depth->header().frame_id());
      },
      frames);
}

/// Makes the frame the chosen one, if it is complete and a better choice.
void DepthOverlayComponent::take(std::uint64_t frame_id) {
  const auto parts = frames_.at(frame_id);
  if (parts.image && parts.depth) {
    seen_ = std::max(seen_, frame_id);
    const auto& image = **parts.image;
    const bool asked_for = config_.frame_id != 0 || config_.stamp_ns != 0;
    const bool usable = asked_for || (*parts.depth)->depth_m_count() > 0;
    if (usable && is_better(image)) chosen_.emplace(Frame{*parts.image, *parts.depth});
    if (config_.exit_when_found && is_found(image)) context_.request_exit();
    progress_.done(image.header());
    frames_.erase(frame_id);
  }
  while (frames_.size() > kFramesKept) frames_.erase(frames_.begin());
}

bool DepthOverlayComponent::is_better(const FrameImage& candidate) const {
  if (config_.stamp_ns != 0) {
    const auto distance_ns = [this](const FrameImage& image) {
      return std::abs(image.header().stamp_ns() - config_.stamp_ns);
    };
    return !chosen_ || distance_ns(candidate) < distance_ns(*chosen_->image);
  }
  const auto wanted = static_cast<std::uint64_t>(config_.frame_id);
  return wanted == 0 || candidate.header().frame_id() == wanted;
}

/// Whether no later frame can be a better choice.
bool DepthOverlayComponent::is_found(const FrameImage& newest) const {
  if (config_.stamp_ns != 0) return newest.header().stamp_ns() >= config_.stamp_ns;
  return config_.frame_id != 0 &&
         newest.header().frame_id() >= static_cast<std::uint64_t>(config_.frame_id);
}

void DepthOverlayComponent::stop() {
  frames_.clear();
  const auto frame = std::exchange(chosen_, std::nullopt);  // nothing may be held after the end
  if (config_.file.empty() && config_.output_dir.empty()) return;
  if (!frame) return context_.log().error("{}", nothing_found());
  if (config_.stamp_ns != 0) {
    const auto stamp_ns = frame->image->header().stamp_ns();
    if (std::abs(stamp_ns - config_.stamp_ns) > kNear_ns) {
      return context_.log().error("no frame near the stamp; the nearest is at {}.{:09} s",
                                  stamp_ns / kSecond_ns,
                                  stamp_ns % kSecond_ns);
    }
  }
  write(*frame,
        config_.file.empty() ? std::filesystem::path(config_.output_dir) / "depth_overlay.png"
                             : std::filesystem::path(config_.file));
}

std::string DepthOverlayComponent::nothing_found() const {
  if (seen_ == 0) return "no frame with image and depth came";
  if (config_.frame_id == 0) return "no frame had depth";
  return fmt::format("there is no frame {}; frames go from 1 to {}", config_.frame_id, seen_);
}

void DepthOverlayComponent::write(const Frame& frame, const std::filesystem::path& file) {
  const auto& image = *frame.image;
  const auto& message = *frame.depth;
  const bool same_size =
      image.width_px() == message.width_px() && image.height_px() == message.height_px();
  if (!same_size || !conversion::is_well_formed(image)) {
    return context_.log().error("depth and image of frame {} do not fit each other",
                                image.header().frame_id());
  }
  std::vector<float> empty;  // a message without depth counts no pixels
  if (message.depth_m_count() == 0) empty.resize(std::size_t{image.width_px()} * image.height_px());
  const depth::DepthView depth{empty.empty() ? message.depth_m().data() : empty.data(),
                               nullptr,
                               static_cast<int>(image.width_px()),
                               static_cast<int>(image.height_px())};
  const depth::FrameLabel label{image.header().frame_id(), image.header().stamp_ns()};
  bool written = false;
  try {
    written = cv::imwrite(file, depth::draw_overlay(conversion::to_bgr(image), depth, label));
  } catch (const cv::Exception&) {
    written = false;
  }
  if (!written) return context_.log().error("{}: cannot be written", file.string());
  context_.log().info("{}", depth::describe(label, depth::summarise(depth)));
}

}  // namespace camvox
