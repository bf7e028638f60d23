// How far a robot seems to go that stands still for long: some simulated seconds (small camera),
// over and over with stamps that go on, through all components. Usage: bench_standstill [seconds]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "camvox/test/pipeline.hpp"

namespace camvox::test {
namespace {

constexpr double kSimulated_s = 9.0;
constexpr std::int64_t kPeriod_ns = 9'000'000'000;

template <typename Message>
void shift(Message& message, std::int64_t by_ns) {
  const auto& stamp = message.header().stamp();
  const std::int64_t stamp_ns = stamp.sec() * std::int64_t{1'000'000'000} + stamp.nanosec();
  set_stamp(message, stamp_ns + by_ns);
  if constexpr (requires { message.timebase(); }) {
    message.timebase(message.timebase() + static_cast<std::uint64_t>(by_ns));
  }
}

Eigen::Vector3d mean_position(const std::vector<Eigen::Vector3d>& positions,
                              std::size_t from,
                              std::size_t count) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = from; i < from + count; ++i) sum += positions[i];
  return sum / static_cast<double>(count);
}

int bench(double seconds) {
  const Recording recording("standstill", kSimulated_s);
  Pipeline pipeline(recording);
  for (int pass = 0; kSimulated_s * pass < seconds; ++pass) {
    for (auto sent : recording.messages()) {
      // The message of the last moment comes again as the first of the next pass.
      if (sent.time_s >= kSimulated_s || kSimulated_s * pass + sent.time_s > seconds) continue;
      sent.arrival_ns += pass * kPeriod_ns;
      std::visit([pass](auto& message) { shift(message, pass * kPeriod_ns); }, sent.message);
      pipeline.send(sent);
    }
  }
  std::vector<Eigen::Vector3d> positions;
  for (const auto& pose : pipeline.poses()) {
    if (pose.state() != camvox_interfaces::msg::TRACKING_OK) continue;
    positions.push_back(conversion::to_se3(pose.T_map_camera()).translation());
  }
  constexpr std::size_t kSecond = 10;  // frames
  if (positions.size() < 2 * kSecond) return EXIT_FAILURE;
  const auto first = mean_position(positions, 0, kSecond);
  double farthest_m = 0.0;
  for (std::size_t i = 0; i + kSecond <= positions.size(); i += kSecond) {
    farthest_m = std::max(farthest_m, (mean_position(positions, i, kSecond) - first).norm());
  }
  const auto last = mean_position(positions, positions.size() - kSecond, kSecond);
  std::printf("%zu of %zu frames tracked, %d keyframes\n",
              positions.size(),
              pipeline.poses().size(),
              pipeline.keyframes());
  std::printf("means of a second: last %.1f mm, farthest %.1f mm from the first\n",
              1e3 * (last - first).norm(),
              1e3 * farthest_m);
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace camvox::test

int main(int argc, char** argv) {
  return camvox::test::bench(argc > 1 ? std::atof(argv[1]) : 60.0);
}
