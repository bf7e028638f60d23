// CPU that a container of 8 wired components needs while nothing happens, in percent of one core.
// Usage: idle_cpu [seconds]
#include <fmt/format.h>
#include <sys/resource.h>

#include <thread>

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/test/test_container.hpp"

namespace camvox {
namespace {

constexpr int kComponents = 8;

double cpu_time_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// A ring: every component reads what its neighbour writes, an edge topic, and has a 1 Hz timer.
void wire(Context& context, int index) {
  using camvox_interfaces::msg::Cloud;
  const auto topic = [](int i) { return fmt::format("/ring_{}", i % kComponents); };
  const auto own = topic(index);
  const auto neighbours = topic(index + 1);
  const auto kept = std::make_shared<Publisher<Cloud>>(context.advertise<Cloud>({"out", own}));
  context.subscribe<Cloud>({"in", neighbours}, [kept](const auto&) {});
  context.subscribe<sensor_msgs::msg::Imu>({"imu", topics::kImu}, [](const auto&) {});
  context.every(std::chrono::seconds(1), [] {});
}

int run(double seconds) {
  test::TestContainer container;
  for (int i = 0; i < kComponents; ++i) wire(container.component(fmt::format("c{}", i)), i);
  container.activate();
  std::this_thread::sleep_for(std::chrono::seconds(2));  // discovery settles
  const double before_s = cpu_time_s();
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  const double share = (cpu_time_s() - before_s) / seconds;
  fmt::print("idle container, {} components: {:.2f} % of one core\n", kComponents, 100 * share);
  return 0;
}

}  // namespace
}  // namespace camvox

int main(int argc, char** argv) { return camvox::run(argc > 1 ? std::stod(argv[1]) : 10.0); }
