#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_model.hpp"
#include "camvox/simulation/image.hpp"
#include "camvox/simulation/ray_scene.hpp"
#include "camvox/simulation/surface_shader.hpp"

namespace camvox::simulation {

/// The camera's behaviour beyond its geometry. YAML keys are the field names.
struct CameraOptions {
  double rate_hz = 10.0;         ///< Images per second.
  double row_time_s = 0.0;       ///< Rolling shutter: time from one row to the next; 0 global.
  double exposure_s = 0.002;     ///< Blur by the robot's own motion; 0 is none.
  double gain = 0.62;            ///< Radiance to full scale, before the gamma curve.
  double gain_variation = 0.03;  ///< Slow relative change of the gain, one sigma.
  double shot_noise = 1.0;       ///< Noise at full brightness, in grey levels of 255.
  double read_noise = 0.8;       ///< Noise in the dark, in grey levels of 255.
  int jpeg_quality = 85;         ///< Of images that are sent compressed, 1 to 100.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("rate_hz", self.rate_hz, config::greater_than(0.0), config::at_most(200.0));
    field("row_time_s", self.row_time_s, config::at_least(0.0), config::at_most(1e-3));
    field("exposure_s", self.exposure_s, config::at_least(0.0), config::at_most(0.1));
    field("gain", self.gain, config::greater_than(0.0), config::at_most(100.0));
    field("gain_variation", self.gain_variation, config::at_least(0.0), config::at_most(0.5));
    field("shot_noise", self.shot_noise, config::at_least(0.0), config::at_most(50.0));
    field("read_noise", self.read_noise, config::at_least(0.0), config::at_most(50.0));
    field("jpeg_quality", self.jpeg_quality, config::at_least(1), config::at_most(100));
  }
};

/// Where the camera is during one image.
struct CameraMotion {
  std::uint64_t index = 0;  ///< Number of the image: picks its noise and gain.
  std::uint64_t seed = 0;   ///< Of noise and gain.
  double time_s = 0.0;      ///< Middle of the exposure of row 0.
  /// The camera's pose at a time; called for every row, from several threads.
  std::function<geometry::SE3(double time_s)> T_world_camera;
};

/// An image with its truth.
struct Rendering {
  ColorImage image;
  DepthImage depth;  ///< Of every pixel's centre, at its row's time; without blur.
};

/// Draws what the camera sees: one ray per pixel through the lens model, two more where surfaces
/// meet (so that edges are as smooth as a lens makes them), sun with shadows, then blur by
/// the camera's motion, gain, gamma and noise. The same input gives the same bytes with any
/// number of threads.
class CameraRenderer {
 public:
  /// `scene` and `shader` must outlive the renderer. Throws config::ConfigError.
  CameraRenderer(const sensors::CameraModel& camera,
                 const CameraOptions& options,
                 const World& world,
                 const SurfaceShader& shader);

  /// Moves the scene's objects to the time of the image and draws it on `threads` threads.
  [[nodiscard]] Rendering render(RayScene& scene, const CameraMotion& motion, int threads) const;

 private:
  struct Canvas;
  struct RowView;
  void trace_row(const RayScene& scene, const RowView& view, Canvas& canvas) const;
  void smooth_edges(const RayScene& scene, const RowView& view, Canvas& canvas) const;
  [[nodiscard]] std::vector<Eigen::Array3f> shade(const RayScene& scene,
                                                  const std::vector<Ray>& rays,
                                                  const std::vector<Hit>& hits) const;
  [[nodiscard]] RowView view_of_row(const CameraMotion& motion, int row) const;
  void blur(const CameraMotion& motion, Canvas& canvas, int threads) const;
  void develop(const CameraMotion& motion,
               const Canvas& canvas,
               ColorImage& image,
               int threads) const;

  sensors::CameraModel camera_;
  CameraOptions options_;
  Lighting lighting_;
  const SurfaceShader* shader_;
  int width_;
  int height_;
  std::vector<Eigen::Vector2f> xy_;  ///< Of every pixel: direction (x, y, 1) in the camera.
};

}  // namespace camvox::simulation
