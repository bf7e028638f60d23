#include <unistd.h>

#include <algorithm>
#include <cstring>

#include "camvox/component/component.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"

namespace camvox {

using camvox_interfaces::msg::FrameImage;

/// Counts the images of SyntheticSourceComponent, and says when it ends what flowed: rate, data
/// rate, latency from publish to callback, how many were read in the writer's memory, losses.
class SinkComponent final : public Component {
 public:
  explicit SinkComponent(Context& context) : context_(context) {
    latencies_us_.reserve(kLatencies);
    context.subscribe<FrameImage>({"frame_image", topics::kFrameImage},
                                  [this](const Sample<FrameImage>& image) { on_image(image); },
                                  {.qos = qos::kFrames});
  }

  ~SinkComponent() override {
    if (images_ > 0) report();
  }

 private:
  void on_image(const Sample<FrameImage>& image) {
    const std::int64_t now_ns = context_.now_ns();
    if (images_++ == 0) first_ns_ = now_ns;
    last_ns_ = now_ns;
    bytes_ += image->data_count();
    lost_ += image.info().lost_before;
    if (latencies_us_.size() == kLatencies) latencies_us_.clear();
    latencies_us_.push_back(1e-3 * static_cast<double>(now_ns - image.info().publish_stamp_ns));
    if (is_writers_memory(*image)) ++same_memory_;
    context_.diagnostics().set("images", images_);
    context_.diagnostics().set("images_in_writers_memory", same_memory_);
    context_.diagnostics().set("latency_us", latencies_us_.back());
  }

  static bool is_writers_memory(const FrameImage& image) {
    std::uint64_t origin[2] = {};
    std::memcpy(origin, image.data().data(), sizeof(origin));
    return origin[0] == reinterpret_cast<std::uintptr_t>(&image) &&
           origin[1] == static_cast<std::uint64_t>(::getpid());
  }

  void report() {
    std::sort(latencies_us_.begin(), latencies_us_.end());
    const auto quantile = [this](double q) {
      return latencies_us_[static_cast<std::size_t>(q *
                                                    static_cast<double>(latencies_us_.size() - 1))];
    };
    const double seconds = 1e-9 * static_cast<double>(last_ns_ - first_ns_);
    const double rate_hz = seconds > 0.0 ? static_cast<double>(images_ - 1) / seconds : 0.0;
    const double image_mb = 1e-6 * static_cast<double>(bytes_) / static_cast<double>(images_);
    context_.log().info(
        "received     {} images of {:.2f} MB in {:.1f} s", images_, image_mb, seconds);
    context_.log().info("rate         {:.1f} images/s, {:.1f} MB/s", rate_hz, rate_hz * image_mb);
    context_.log().info("latency      p50 {:.0f} us, p99 {:.0f} us, max {:.0f} us",
                        quantile(0.5),
                        quantile(0.99),
                        quantile(1.0));
    context_.log().info("zero copy    {} of {} images read at the address that the source filled",
                        same_memory_,
                        images_);
    context_.log().info("lost         {}", lost_);
  }

  static constexpr std::size_t kLatencies = 100000;

  Context& context_;
  std::uint64_t images_ = 0;
  std::uint64_t bytes_ = 0;
  std::uint64_t lost_ = 0;
  std::uint64_t same_memory_ = 0;
  std::int64_t first_ns_ = 0;
  std::int64_t last_ns_ = 0;
  std::vector<double> latencies_us_;
};

}  // namespace camvox

CAMVOX_REGISTER_COMPONENT(camvox::SinkComponent)
