#include <unistd.h>

#include <cstring>

#include "camvox/component/component.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"

namespace camvox {

using camvox_interfaces::msg::FrameImage;

struct SyntheticSourceConfig {
  double rate_hz = 30.0;  ///< Images per second.
  int width_px = 1920;
  int height_px = 1080;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("rate_hz", self.rate_hz, config::greater_than(0.0), config::at_most(1000.0));
    field("width_px", self.width_px, config::at_least(16), config::at_most(2896));
    field("height_px", self.height_px, config::at_least(1), config::at_most(2896));
  }
};

/// Publishes grey test images. The first 16 bytes of each hold the address that it was filled at
/// and the process id, so that a reader can prove that it looks at the very same memory.
class SyntheticSourceComponent final : public Component {
 public:
  explicit SyntheticSourceComponent(Context& context)
      : config_(context.parameters<SyntheticSourceConfig>()),
        context_(context),
        publisher_(context.advertise<FrameImage>({"frame_image", topics::kFrameImage},
                                                 {.qos = qos::kFrames})) {
    context.every(std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / config_.rate_hz)),
                  [this] { publish(); });
  }

 private:
  void publish() {
    auto image = publisher_.loan();
    image->header().stamp_ns(context_.now_ns());
    image->header().frame_id(++frames_);
    image->width_px(static_cast<std::uint32_t>(config_.width_px));
    image->height_px(static_cast<std::uint32_t>(config_.height_px));
    image->row_step_bytes(image->width_px());
    image->data_count(image->width_px() * image->height_px());
    image->encoding(camvox_interfaces::msg::ENCODING_MONO8);
    std::memset(image->data().data(), static_cast<int>(frames_ & 0xFF), image->data_count());
    const std::uint64_t origin[2] = {reinterpret_cast<std::uintptr_t>(&*image),
                                     static_cast<std::uint64_t>(::getpid())};
    std::memcpy(image->data().data(), origin, sizeof(origin));
    publisher_.publish(std::move(image));
    context_.diagnostics().set("images", frames_);
  }

  SyntheticSourceConfig config_;
  Context& context_;
  Publisher<FrameImage> publisher_;
  std::uint64_t frames_ = 0;
};

}  // namespace camvox

CAMVOX_REGISTER_COMPONENT(camvox::SyntheticSourceComponent)
