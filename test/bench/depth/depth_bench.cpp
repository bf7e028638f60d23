#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "camvox/depth/depth_projector.hpp"
#include "camvox/depth/sample_depth.hpp"
#include "camvox/test/depth_scene.hpp"

/// Prints what the depth projection reaches on simulated frames with known depth, as Markdown:
/// filled share, bleeding, whether sigma is honest, depth of FAST corners, and CPU time.
namespace {

using camvox::depth::DepthProjector;
using camvox::test::DepthJudgement;
using camvox::test::DepthScene;

double thread_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// Corners with depth, and how many of those depths are that of a surface within a pixel or two.
struct CornerJudgement {
  std::size_t corners = 0;
  std::size_t at_pixel = 0;   ///< With depth at the pixel itself.
  std::size_t sampled = 0;    ///< With depth from sample_depth.
  std::size_t right = 0;      ///< Of these: within 3 sigma + 1 % of the nearest surface beside it.
  std::size_t plausible = 0;  ///< Of these: of any surface beside it.

  void add(const DepthScene& scene, const camvox::depth::DepthView& view) {
    const cv::Mat rgb(scene.image.height_px,
                      scene.image.width_px,
                      CV_8UC3,
                      const_cast<unsigned char*>(scene.image.rgb.data()));
    cv::Mat grey;
    cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
    std::vector<cv::KeyPoint> found;
    cv::FAST(grey, found, 20, true);
    for (const cv::KeyPoint& corner : found) add(scene, view, corner.pt.x, corner.pt.y);
  }

  void add(const DepthScene& scene, const camvox::depth::DepthView& view, float u_px, float v_px) {
    const int u = static_cast<int>(u_px);
    const int v = static_cast<int>(v_px);
    const float truth = scene.truth.at(u, v);
    if (truth <= 0.0F || truth > 130.0F) return;
    ++corners;
    at_pixel += view.depth_m[v * view.width_px + u] > 0.0F ? 1 : 0;
    const auto sample = camvox::depth::sample_depth(view, u_px, v_px, 3);
    if (sample.depth_m <= 0.0F) return;
    ++sampled;
    float nearest = 1e9F;
    bool any = false;
    const auto matches = [&](float z) {
      return std::abs(sample.depth_m - z) < 3.0F * sample.sigma_m + 0.01F * z;
    };
    for (int dv = -2; dv <= 2; ++dv) {
      for (int du = -2; du <= 2; ++du) {
        const int x = std::clamp(u + du, 0, view.width_px - 1);
        const int y = std::clamp(v + dv, 0, view.height_px - 1);
        const float z = scene.truth.at(x, y);
        if (z <= 0.0F) continue;
        nearest = std::min(nearest, z);
        any = any || matches(z);
      }
    }
    right += matches(nearest) || matches(truth) ? 1 : 0;
    plausible += any ? 1 : 0;
  }
};

struct Totals {
  DepthJudgement pixels;
  CornerJudgement corners;
  std::vector<double> times_ms;
  std::size_t returns = 0;
  std::size_t hidden = 0;
  std::size_t gross_behind = 0;
  std::size_t gross_front = 0;
  std::size_t frames = 0;
};

void run(DepthProjector& projector,
         const camvox::geometry::SE3& T_camera_lidar,
         const DepthScene& scene,
         Totals& totals) {
  std::vector<float> depth_m(scene.truth.z_m.size());
  std::vector<float> sigma_m(scene.truth.z_m.size());
  const camvox::depth::ScanView scan{scene.points_lidar, T_camera_lidar};
  camvox::depth::ProjectionReport report;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const double start_ms = thread_ms();
    report = projector.project({&scan, 1}, depth_m, sigma_m);
    totals.times_ms.push_back(thread_ms() - start_ms);
  }
  totals.pixels.add(depth_m.data(), sigma_m.data(), scene.truth);
  totals.corners.add(scene,
                     {depth_m.data(), sigma_m.data(), scene.truth.width_px, scene.truth.height_px});
  for (std::size_t i = 0; i < depth_m.size(); ++i) {
    const float z = scene.truth.z_m[i];
    if (depth_m[i] <= 0.0F) continue;
    totals.gross_behind +=
        z > 0.0F && depth_m[i] > 1.03F * z && depth_m[i] > z + 3 * sigma_m[i] ? 1 : 0;
    totals.gross_front +=
        (z <= 0.0F || depth_m[i] < 0.97F * z) && depth_m[i] < z - 3 * sigma_m[i] ? 1 : 0;
  }
  totals.returns += report.returns;
  totals.hidden += report.hidden;
  ++totals.frames;
}

double percent(std::size_t part, std::size_t whole) {
  return 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

void print(const std::string& name, Totals& totals) {
  std::sort(totals.times_ms.begin(), totals.times_ms.end());
  const auto& p = totals.pixels;
  const auto& c = totals.corners;
  const std::size_t n = totals.times_ms.size();
  std::printf(
      "| %s | %zu | %.1f | %.3f | %.3f | %.3f | %.2f | %.2f | %.2f | %.1f | %.1f | %.2f | %.2f to "
      "%.2f |\n",
      name.c_str(),
      totals.returns / totals.frames,
      100.0 * p.fill(),
      100.0 * p.behind_share(),
      100.0 * p.in_front_share(),
      100.0 * p.far_off_share(),
      p.mean(),
      p.deviation(),
      100.0 * p.relative_sigma / static_cast<double>(p.filled),
      percent(c.at_pixel, c.corners),
      percent(c.sampled, c.corners),
      percent(c.right, c.sampled),
      totals.times_ms[n / 2],
      totals.times_ms[n * 9 / 10]);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  int frames = 4;
  int scans = 1;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--frames") == 0) frames = std::atoi(argv[i + 1]);
    if (std::strcmp(argv[i], "--scans") == 0) scans = std::atoi(argv[i + 1]);
  }
  std::printf(
      "| world | returns | filled %% | behind %% | in front %% | > 5 sigma %% | mean | std | "
      "sigma %% | corners %% | sampled %% | right %% | CPU ms p50 to p90 |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const char* name : {"loop_400m", "demo", "corridor"}) {
    camvox::test::DepthSceneMaker maker(camvox::simulation::preset(name));
    DepthProjector projector(maker.camera(),
                             {.extrinsics_sigma_deg = 0.0, .extrinsics_sigma_m = 0.0});
    Totals totals;
    for (int i = 0; i < frames; ++i) {
      run(projector,
          maker.T_camera_lidar(),
          maker.make((i + 0.5) * maker.duration_s() / frames, scans),
          totals);
    }
    print(name, totals);
  }
  return 0;
}
