#pragma once

#include <deque>
#include <map>
#include <string>

#include "camvox/component/component.hpp"
#include "camvox/component/progress.hpp"
#include "camvox/dense/dense_map.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"

namespace camvox {

/// Parameters of DenseMapComponent.
struct DenseMapComponentConfig {
  std::string output_dir;         ///< Folder to save to at the end; "" saves nothing.
  double publish_period_s = 2.0;  ///< How often the cloud is sent while somebody reads it.
  dense::DenseMapConfig map;
  sensors::CameraIntrinsics camera;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("output_dir", self.output_dir);
    field("publish_period_s", self.publish_period_s, config::at_least(0.1));
    field("map", self.map);
    field("camera", self.camera);
  }
};

/// Keeps the coloured points of all keyframes (see dense::DenseMap), streams them as PointCloud2 in
/// the frame `map` and saves them at the end: dense_map.pcd, dense_map.ply, and dense_map.png, the
/// map from above. Colours need frame images with colour (sync: `encoding: yuv420`).
class DenseMapComponent final : public Component {
 public:
  explicit DenseMapComponent(Context& context);
  void stop() override;

 private:
  using FrameImage = camvox_interfaces::msg::FrameImage;
  using DepthImage = camvox_interfaces::msg::DepthImage;
  using Keyframe = camvox_interfaces::msg::Keyframe;
  using FramePose = camvox_interfaces::msg::FramePose;
  using MapUpdate = camvox_interfaces::msg::MapUpdate;

  /// A tracked frame that was not yet reported done.
  struct OpenFrame {
    camvox_interfaces::msg::MessageHeader header;
    std::uint64_t reference_id = 0;
  };
  struct PendingKeyframe {
    std::uint64_t id = 0;
    geometry::SE3 T_map_camera;
  };

  template <typename Message>
  void keep(std::map<std::uint64_t, Sample<Message>>& frames, const Sample<Message>& sample);
  void on_keyframe(const Keyframe& keyframe);
  void on_pose(const FramePose& pose);
  void on_update(const MapUpdate& update);
  void add_if_complete(std::uint64_t frame_id);
  void report_done();
  void publish();

  Context& context_;
  DenseMapComponentConfig config_;
  dense::DenseMap map_;
  ProgressReporter progress_;
  Publisher<sensor_msgs::msg::PointCloud2> cloud_;
  // By frame id, the newest few: a keyframe is known only after its images.
  std::map<std::uint64_t, Sample<FrameImage>> images_;
  std::map<std::uint64_t, Sample<DepthImage>> depths_;
  std::map<std::uint64_t, PendingKeyframe> pending_;
  std::deque<OpenFrame> open_;
  std::uint64_t newest_keyframe_ = 0;
  std::uint64_t missed_ = 0;
};

}  // namespace camvox
