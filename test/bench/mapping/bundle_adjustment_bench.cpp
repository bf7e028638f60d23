// Processor time of bundle adjustment at the sizes of local mapping and of a whole map:
//   bundle_adjustment_bench
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <vector>

#include "bundle_world.hpp"

namespace {

using namespace camvox::optimization;

double processor_time_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void measure(const BundleWorldOptions& options, int runs) {
  std::vector<double> times_ms;
  BundleSummary summary;
  for (int run = 0; run < runs; ++run) {
    auto world = make_bundle_world(options, static_cast<unsigned>(run));
    const double start_s = processor_time_s();
    summary = adjust(world.problem);
    times_ms.push_back(1e3 * (processor_time_s() - start_s));
  }
  std::sort(times_ms.begin(), times_ms.end());
  std::printf("median %.1f ms (%.1f to %.1f) | last: %s\n",
              times_ms[times_ms.size() / 2],
              times_ms.front(),
              times_ms.back(),
              summary.to_string(1e-3 * times_ms.back()).c_str());
}

}  // namespace

int main() {
  measure({.free_poses = 10, .fixed_poses = 10, .points = 1500, .spacing_m = 2.0}, 11);
  measure({.free_poses = 15, .fixed_poses = 15, .points = 2500, .spacing_m = 2.0}, 11);
  measure({.free_poses = 20, .fixed_poses = 20, .points = 4000, .spacing_m = 2.0}, 11);
  measure({.free_poses = 300, .fixed_poses = 1, .points = 40000, .spacing_m = 1.5}, 3);
}
