#include "camvox/component/component.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/header.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"

using camvox_interfaces::msg::FrameImage;

struct ThumbnailConfig {
  int step_px = 8;  ///< Every how many pixels one is taken.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("step_px", self.step_px, camvox::config::at_least(1));
  }
};

/// Publishes small grey copies of the frame images for viewers (ROS 2 sensor_msgs/Image).
class ThumbnailComponent final : public camvox::Component {
 public:
  explicit ThumbnailComponent(camvox::Context& context)
      : step_px_(static_cast<std::uint32_t>(context.parameters<ThumbnailConfig>().step_px)),
        publisher_(context.advertise<sensor_msgs::msg::Image>({"thumbnail", "/camvox/thumbnail"})) {
    context.subscribe<FrameImage>({"frame_image", camvox::topics::kFrameImage},
                                  [this](const auto& frame) { publish_thumbnail(*frame); });
  }

 private:
  void publish_thumbnail(const FrameImage& frame) {  // `frame` is the writer's memory: no copy
    if (frame.encoding() != camvox_interfaces::msg::ENCODING_MONO8) return;
    auto thumbnail = publisher_.loan();
    thumbnail->header(camvox::interfaces::to_header(frame.header().stamp_ns(), "camera"));
    thumbnail->encoding("mono8");
    thumbnail->width((frame.width_px() + step_px_ - 1) / step_px_);
    thumbnail->height((frame.height_px() + step_px_ - 1) / step_px_);
    thumbnail->step(thumbnail->width());
    for (std::uint32_t v = 0; v < frame.height_px(); v += step_px_)
      for (std::uint32_t u = 0; u < frame.width_px(); u += step_px_)
        thumbnail->data().push_back(frame.data()[v * frame.row_step_bytes() + u]);
    publisher_.publish(std::move(thumbnail));
  }

  std::uint32_t step_px_;
  camvox::Publisher<sensor_msgs::msg::Image> publisher_;
};

CAMVOX_REGISTER_COMPONENT(ThumbnailComponent)
