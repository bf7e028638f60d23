#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "camvox/component/component.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/sensors/rig.hpp"
#include "camvox/trajectory/keyframe_path.hpp"

namespace camvox {

/// Parameters of ResultsComponent.
struct ResultsConfig {
  std::string output_dir;           ///< Folder to write to; "" writes nothing.
  bool fail_without_poses = false;  ///< A run that tracked no frame ends with an error.
  sensors::RigConfig rig;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("output_dir", self.output_dir);
    field("fail_without_poses", self.fail_without_poses);
    field("rig", self.rig);
  }
};

/// Follows a run and writes at its end, all poses as TUM files of the body in the map:
///
/// | file | content |
/// | --- | --- |
/// | trajectory.tum | every frame that was tracked, as the finished map has it |
/// | odometry.tum | the same as tracking said it at the time |
/// | keyframes.tum | the keyframes of the finished map |
/// | frames.csv | state, features, matches and time of every frame |
/// | timing.csv | processor time a frame of every component: median, mean, p95, p99, maximum |
class ResultsComponent final : public Component {
 public:
  explicit ResultsComponent(Context& context);
  /// Where no frame came, earlier results stay. Throws std::runtime_error when not all could be
  /// saved, or, as configured, there was no pose.
  void stop() override;

 private:
  [[nodiscard]] std::string not_tried();
  void save();
  [[nodiscard]] std::string why_no_pose() const;
  void add_pose(const camvox_interfaces::msg::FramePose& pose);
  void add_update(const camvox_interfaces::msg::MapUpdate& update);
  [[nodiscard]] bool save_trajectory(const char* name, trajectory::Trajectory of_camera);
  [[nodiscard]] bool save_text(const char* name, const std::string& text);

  Context& context_;
  ResultsConfig config_;
  geometry::SE3 T_camera_body_;
  trajectory::KeyframePath path_;
  trajectory::Trajectory odometry_;
  std::string frames_csv_;
  int frames_ = 0;
  std::set<std::uint64_t> came_;  ///< Frames that anybody has seen, tracking or not.
  int frames_with_depth_ = 0;
  std::map<std::string, std::vector<double>> times_s_;  // by component
};

}  // namespace camvox
