#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "camvox/component/component.hpp"
#include "camvox/component/progress.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/lidar/force_unit.hpp"
#include "camvox/lidar/stationary.hpp"
#include "camvox/sync/depth_pairing.hpp"
#include "camvox/sync/frame_assembler.hpp"
#include "camvox/sync_component/image_input.hpp"
#include "camvox/sync_component/lidar_input.hpp"
#include "camvox/sync_component/scan_output.hpp"
#include "camvox/sync_component/sync_component_config.hpp"
#include "camvox/sync_component/sync_report.hpp"

namespace camvox {

/// Makes frames of the sensors' streams: for every trigger one frame image and one scan (or one
/// depth image, of an RGB-D camera) with the same frame id, 1, 2, 3, ...; after a restart the ids
/// go on far above, since they are what all others tell old from new by. See sync::FrameAssembler
/// for what belongs to a frame and how long it is waited for. Images are decoded when they come,
/// straight into the memory that tracking will read. A trigger without lidar data gets a scan
/// without points. Progress is reported for each image, also for those that made no frame.
class SyncComponent final : public Component {
 public:
  explicit SyncComponent(Context& context);
  void stop() override;

 private:
  using FrameImage = camvox_interfaces::msg::FrameImage;
  using DepthImage = camvox_interfaces::msg::DepthImage;
  using Scan = camvox_interfaces::msg::Scan;

  void subscribe_camera();
  void subscribe_depth_source();
  template <typename Image>
  void on_image(const Image& image);
  void on_depth(const sensor_msgs::msg::Image& image);
  void on_imu(const sensor_msgs::msg::Imu& imu);
  template <typename Message, typename Read>
  void on_lidar(const Message& message, Read read);

  void tell_missing_inputs(bool at_end);
  void publish_ready();
  void publish(const sync::Frame& frame);
  void fill(Scan& scan, const sync::Frame& frame, const FrameImage& image);
  void publish_depth(const sync::Frame& frame);
  void leave_out(std::int64_t stamp_ns, const std::string& why);
  void report_progress(std::int64_t stamp_ns, std::uint64_t frame_id);
  [[nodiscard]] bool has_lidar() const { return config_.depth_source != "depth_image"; }

  Context& context_;
  SyncComponentConfig config_;
  sync_component::LidarInputOptions lidar_options_;
  sync_component::ImageInput image_input_;
  sync::FrameAssembler assembler_;
  sync::DepthPairing<std::shared_ptr<Loan<DepthImage>>> depth_pairing_;
  lidar::ForceUnit force_unit_;
  lidar::StationaryDetector stationary_;
  sync_component::SyncReport report_;
  ProgressReporter progress_;
  Publisher<FrameImage> frame_images_;
  Publisher<Scan> scans_;
  Publisher<DepthImage> depth_images_;
  std::deque<Loan<FrameImage>> images_;  // of the pending frames
  std::uint64_t next_frame_id_;
  std::optional<std::int64_t> previous_image_ns_;
  int looks_ = 0;  ///< For missing inputs, since the first message.
  bool missing_told_ = false;
};

}  // namespace camvox
