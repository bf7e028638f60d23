#include "camvox/simulation/camera_renderer.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "camvox/simulation/random.hpp"
#include "parallel.hpp"

namespace camvox::simulation {
namespace {

using Eigen::Array3f;
using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr std::uint64_t kNoiseStream = 1;
constexpr std::uint64_t kGainStream = 2;
constexpr float kHazeLength_m = 1200.0f;

/// Identity of the surface at a hit; the two triangles of a quad count as one.
std::uint64_t surface_key(const Hit& hit) {
  return (static_cast<std::uint64_t>(hit.object) << 32) | (hit.triangle >> 1);
}

/// The gamma curve of the display, tabulated over linear radiance 0 to 1.
const std::array<float, 4097>& gamma_curve() {
  static const auto curve = [] {
    std::array<float, 4097> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = 255.0f * std::pow(static_cast<float>(i) / 4096.0f, 1.0f / 2.2f);
    }
    return values;
  }();
  return curve;
}

}  // namespace

/// An image in the making.
struct CameraRenderer::Canvas {
  explicit Canvas(std::size_t pixels) : radiance(pixels), depth(pixels), key(pixels) {}
  std::vector<Array3f> radiance;
  std::vector<float> depth;
  std::vector<std::uint64_t> key;
};

/// The camera while it reads one row.
struct CameraRenderer::RowView {
  int row;
  float time;  ///< Within the scene's interval.
  Eigen::Matrix3f R_world_camera;
  Vector3f p_world_camera;

  [[nodiscard]] Ray ray(const Vector2f& xy) const {
    return {p_world_camera, R_world_camera * xy.homogeneous(), time};
  }
};

CameraRenderer::CameraRenderer(const sensors::CameraModel& camera,
                               const CameraOptions& options,
                               const World& world,
                               const SurfaceShader& shader)
    : camera_(camera),
      options_(options),
      lighting_(world.lighting),
      shader_(&shader),
      width_(camera.intrinsics().width_px),
      height_(camera.intrinsics().height_px) {
  config::require_valid(options, "camera");
  xy_.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      const Eigen::Vector3d f_camera = camera.unproject(Eigen::Vector2d(column, row)).f_camera;
      xy_.push_back((f_camera.head<2>() / f_camera.z()).cast<float>());
    }
  }
}

Rendering CameraRenderer::render(RayScene& scene, const CameraMotion& motion, int threads) const {
  const double readout_s = options_.row_time_s * (height_ - 1);
  scene.set_interval(motion.time_s, motion.time_s + readout_s);
  Canvas canvas(xy_.size());
  const auto each_row = [&](const auto& work) {
    parallel_for(height_, threads, [&](int row) { work(view_of_row(motion, row)); });
  };
  each_row([&](const RowView& view) { trace_row(scene, view, canvas); });
  each_row([&](const RowView& view) { smooth_edges(scene, view, canvas); });
  if (options_.exposure_s > 0.0) blur(motion, canvas, threads);
  Rendering rendering;
  rendering.image = {width_, height_, std::vector<std::uint8_t>(3 * xy_.size())};
  develop(motion, canvas, rendering.image, threads);
  rendering.depth = {width_, height_, std::move(canvas.depth)};
  return rendering;
}

CameraRenderer::RowView CameraRenderer::view_of_row(const CameraMotion& motion, int row) const {
  const geometry::SE3 T_world_camera =
      motion.T_world_camera(motion.time_s + row * options_.row_time_s);
  return {row,
          height_ > 1 ? static_cast<float>(row) / static_cast<float>(height_ - 1) : 0.0f,
          T_world_camera.rotation().matrix().cast<float>(),
          T_world_camera.translation().cast<float>()};
}

void CameraRenderer::trace_row(const RayScene& scene, const RowView& view, Canvas& canvas) const {
  const std::size_t first = static_cast<std::size_t>(view.row) * static_cast<std::size_t>(width_);
  std::vector<Ray> rays;
  rays.reserve(static_cast<std::size_t>(width_));
  for (std::size_t i = 0; i < static_cast<std::size_t>(width_); ++i) {
    rays.push_back(view.ray(xy_[first + i]));
  }
  std::vector<Hit> hits(rays.size());
  scene.intersect(rays, hits);
  const std::vector<Array3f> radiance = shade(scene, rays, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    canvas.radiance[first + i] = radiance[i];
    canvas.depth[first + i] = hits[i].found() ? hits[i].distance : 0.0f;
    canvas.key[first + i] = surface_key(hits[i]);
  }
}

void CameraRenderer::smooth_edges(const RayScene& scene,
                                  const RowView& view,
                                  Canvas& canvas) const {
  // Beside the centre, two places across a slanted line whose slope alternates like a chess
  // board: with the centre's own ray three levels for edges of any direction.
  static const Vector2f kOffsets[2][2] = {{{-0.35f, -0.2f}, {0.35f, 0.2f}},
                                          {{-0.2f, 0.35f}, {0.2f, -0.35f}}};
  const int row = view.row;
  const auto index = [&](int column, int line) {
    return static_cast<std::size_t>(line) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(column);
  };
  std::vector<std::size_t> edges;
  for (int column = 0; column < width_; ++column) {
    const std::uint64_t key = canvas.key[index(column, row)];
    const bool edge = (column > 0 && canvas.key[index(column - 1, row)] != key) ||
                      (column + 1 < width_ && canvas.key[index(column + 1, row)] != key) ||
                      (row > 0 && canvas.key[index(column, row - 1)] != key) ||
                      (row + 1 < height_ && canvas.key[index(column, row + 1)] != key);
    if (edge) edges.push_back(index(column, row));
  }
  std::vector<Ray> rays;
  for (const std::size_t pixel : edges) {
    const Vector2f step(1.0f / static_cast<float>(camera_.intrinsics().fx_px),
                        1.0f / static_cast<float>(camera_.intrinsics().fy_px));
    const auto parity = (pixel + static_cast<std::size_t>(row)) % 2;
    for (const Vector2f& offset : kOffsets[parity]) {
      rays.push_back(view.ray(xy_[pixel] + offset.cwiseProduct(step)));
    }
  }
  std::vector<Hit> hits(rays.size());
  scene.intersect(rays, hits);
  const std::vector<Array3f> radiance = shade(scene, rays, hits);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    Array3f& center = canvas.radiance[edges[i]];
    center = (center + radiance[2 * i] + radiance[2 * i + 1]) / 3.0f;
  }
}

std::vector<Array3f> CameraRenderer::shade(const RayScene& scene,
                                           const std::vector<Ray>& rays,
                                           const std::vector<Hit>& hits) const {
  const float pixel_angle = 1.0f / static_cast<float>(camera_.intrinsics().fx_px);
  std::vector<Array3f> radiance(rays.size());
  std::vector<Ray> shadow_rays;
  std::vector<std::pair<std::size_t, Array3f>> sunlit;  ///< Pixel, and what the sun adds to it.
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Vector3f direction = rays[i].direction_world.normalized();
    if (!hits[i].found()) {
      radiance[i] = lighting_.sky ? shader_->sky(direction) : Array3f(Array3f::Constant(0.02f));
      continue;
    }
    const Surface surface = scene.surface(hits[i]);
    const float facing = surface.normal_world.dot(direction);
    const Vector3f normal = facing > 0.0f ? Vector3f(-surface.normal_world) : surface.normal_world;
    // A pixel sees an ellipse, long by 1 / cos along the view; the exponent trades its blur
    // against aliasing.
    const float root = std::sqrt(std::max(std::abs(facing), 0.03f));
    const float footprint = hits[i].distance * pixel_angle / (root * std::sqrt(root));
    const Array3f albedo = shader_->albedo(surface, footprint);
    if (surface.material->glows) {
      radiance[i] = albedo;
      continue;
    }
    const float range_m = hits[i].distance * rays[i].direction_world.norm();
    const float clear = lighting_.sky ? std::exp(-range_m / kHazeLength_m) : 1.0f;
    const Array3f ambient =
        lighting_.ambient * Array3f(0.92f, 0.97f, 1.08f) * (0.75f + 0.25f * normal.z());
    radiance[i] = clear * albedo * ambient + (1.0f - clear) * SurfaceShader::haze();
    const float sun = lighting_.sun * normal.dot(lighting_.to_sun_world);
    if (sun <= 0.0f) continue;
    const Vector3f point = rays[i].origin_world + hits[i].distance * rays[i].direction_world;
    shadow_rays.push_back(
        {point + (0.002f + 1e-4f * range_m) * normal, lighting_.to_sun_world, rays[i].time});
    sunlit.emplace_back(i, clear * sun * albedo * Array3f(1.05f, 1.0f, 0.92f));
  }
  std::vector<std::uint8_t> blocked(shadow_rays.size());
  scene.occluded(shadow_rays, blocked);
  for (std::size_t i = 0; i < sunlit.size(); ++i) {
    if (blocked[i] == 0) radiance[sunlit[i].first] += sunlit[i].second;
  }
  return radiance;
}

void CameraRenderer::blur(const CameraMotion& motion, Canvas& canvas, int threads) const {
  // The image is smeared along each pixel's motion, known from its depth and the camera's
  // velocity; moving objects are smeared as if they stood.
  constexpr double kStep_s = 1e-3;
  const geometry::Vector6d twist = geometry::local(motion.T_world_camera(motion.time_s - kStep_s),
                                                   motion.T_world_camera(motion.time_s + kStep_s)) /
                                   (2.0 * kStep_s);
  const Vector3f w = twist.head<3>().cast<float>();
  const Vector3f v = twist.tail<3>().cast<float>();
  const auto fx = static_cast<float>(camera_.intrinsics().fx_px);
  const auto exposure = static_cast<float>(options_.exposure_s);
  const std::vector<Array3f> sharp = canvas.radiance;
  parallel_for(height_, threads, [&](int row) {
    for (int column = 0; column < width_; ++column) {
      const std::size_t pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                                static_cast<std::size_t>(column);
      const float inverse_depth = canvas.depth[pixel] > 0.0f ? 1.0f / canvas.depth[pixel] : 0.0f;
      const Vector3f ray = xy_[pixel].homogeneous();
      const Vector3f flow = -(v * inverse_depth + w.cross(ray));
      const Vector2f smear = exposure * fx * (flow.head<2>() - flow.z() * xy_[pixel]);
      const int samples = std::min(static_cast<int>(smear.norm() * 1.5f) + 1, 24);
      if (samples == 1) continue;
      Array3f sum = Array3f::Zero();
      for (int i = 0; i < samples; ++i) {
        const float along = (static_cast<float>(i) + 0.5f) / static_cast<float>(samples) - 0.5f;
        const auto x =
            static_cast<int>(std::lround(static_cast<float>(column) + along * smear.x()));
        const auto y = static_cast<int>(std::lround(static_cast<float>(row) + along * smear.y()));
        sum += sharp[static_cast<std::size_t>(std::clamp(y, 0, height_ - 1)) *
                         static_cast<std::size_t>(width_) +
                     static_cast<std::size_t>(std::clamp(x, 0, width_ - 1))];
      }
      canvas.radiance[pixel] = sum / static_cast<float>(samples);
    }
  });
}

void CameraRenderer::develop(const CameraMotion& motion,
                             const Canvas& canvas,
                             ColorImage& image,
                             int threads) const {
  const CounterRandom noise(motion.seed ^ mix_bits(motion.index), kNoiseStream);
  const CounterRandom gains(motion.seed, kGainStream);
  // The gain wanders over about a second: interpolated between one random number per ten images.
  const double phase = static_cast<double>(motion.index % 10) / 10.0;
  const double wander =
      (1.0 - phase) * gains.normal(motion.index / 10) + phase * gains.normal(motion.index / 10 + 1);
  const auto gain = static_cast<float>(options_.gain * std::exp(options_.gain_variation * wander));
  const auto shot = static_cast<float>(options_.shot_noise);
  const auto read = static_cast<float>(options_.read_noise);
  const auto& curve = gamma_curve();
  parallel_for(height_, threads, [&](int row) {
    const std::size_t first = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
    for (std::size_t pixel = first; pixel < first + static_cast<std::size_t>(width_); ++pixel) {
      for (int channel = 0; channel < 3; ++channel) {
        const float linear = std::clamp(gain * canvas.radiance[pixel][channel], 0.0f, 1.0f);
        const float level = curve[static_cast<std::size_t>(linear * 4096.0f)];
        const float sigma = read + (shot - read) * std::sqrt(linear);
        const float noisy =
            level + sigma * noise.fast_normal(pixel, static_cast<std::uint64_t>(channel));
        image.rgb[3 * pixel + static_cast<std::size_t>(channel)] =
            static_cast<std::uint8_t>(std::clamp(noisy + 0.5f, 0.0f, 255.0f));
      }
    }
  });
}

}  // namespace camvox::simulation
