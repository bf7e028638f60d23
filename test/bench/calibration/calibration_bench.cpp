#include <pthread.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <numbers>
#include <random>
#include <thread>

#include "bench_case.hpp"
#include "camvox/calibration/calibrator.hpp"
#include "tally.hpp"

// Prints, in Markdown, what calibration reaches; what each start gave goes to stderr.
//   bench_calibration synthetic [starts = 20] [degrees = 5] [first case = 0] [cases = all]
//   bench_calibration real      [starts = 50] [degrees = 3] [first case = 0] [cases = all]
//   bench_calibration camvox    [starts = 3]  [degrees = 2] [first case = 0] [cases = all]
//   bench_calibration cancel    [times = 20]
// `camvox` is the paper's method, with its cost at the start, the result and the truth.
namespace camvox::bench {
namespace {

using geometry::SE3;

constexpr double kDegree = std::numbers::pi / 180.0;

double seconds_of(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double thread_seconds() { return seconds_of(CLOCK_THREAD_CPUTIME_ID); }

/// A start off by up to `max_deg` about any axis, and by up to 10 cm.
SE3 random_start(const SE3& truth, std::mt19937& generator, double max_deg) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const auto direction = [&] {
    return Eigen::Vector3d(normal(generator), normal(generator), normal(generator)).normalized();
  };
  const Eigen::Vector3d turn = direction() * (uniform(generator) * max_deg * kDegree);
  const Eigen::Vector3d shift = direction() * (uniform(generator) * 0.1);
  return {geometry::SO3::exp(turn) * truth.rotation(), truth.translation() + shift};
}

/// What the command line asks for.
struct Work {
  int starts = 20;
  double max_deg = 5.0;
  std::size_t first = 0;
  std::size_t count = 99;
  calibration::CalibrationConfig config;
  Limits limits;
};

Tally measure(const BenchCase& bench_case, std::size_t index, const Work& work) {
  std::mt19937 generator(static_cast<unsigned>(100 + index));
  Tally tally(work.limits);
  for (int k = 0; k < work.starts; ++k) {
    const SE3 start = random_start(bench_case.T_camera_lidar, generator, work.max_deg);
    const double begin = thread_seconds();
    const auto result =
        calibration::calibrate(bench_case.scenes, bench_case.intrinsics, start, work.config);
    tally.add(bench_case, result, thread_seconds() - begin);
  }
  return tally;
}

void print_memory(const Work& work) {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::printf("\nmethod %s, starts up to %.1f deg and 10 cm; peak memory %ld MB\n",
              work.config.method.c_str(),
              work.max_deg,
              usage.ru_maxrss / 1024);
}

/// Cases are made one by one: together they would take more memory than a calibration.
void run_all(const Work& work,
             std::size_t count,
             const std::function<BenchCase(std::size_t)>& make_case) {
  Tally::print_head(work.limits);
  Tally all(work.limits);
  for (std::size_t i = work.first; i < std::min(work.first + work.count, count); ++i) {
    const BenchCase bench_case = make_case(i);
    const Tally tally = measure(bench_case, i, work);
    tally.print(bench_case.name);
    all.add(tally);
  }
  all.print("all");
  print_memory(work);
}

void run_camvox(const Work& work) {
  std::puts(
      "| scene | cost at the start | at the result | at the truth | median deg | max deg | CPU s "
      "|\n| --- | --- | --- | --- | --- | --- | --- |\n"
      "| the paper, one scene | 7.95 | 6.11 | 5.88 (by hand) | | | 58.16 |");
  for (std::size_t i = work.first; i < std::min(work.first + work.count, synthetic_count()); ++i) {
    const BenchCase bench_case = synthetic_case(i);
    const calibration::CamvoxCost cost(
        bench_case.scenes.front(), sensors::CameraModel(bench_case.intrinsics), work.config.camvox);
    measure(bench_case, i, work).print_costs(bench_case.name, cost(bench_case.T_camera_lidar));
  }
  print_memory(work);
}

/// Asks at times spread evenly over a whole calibration. Processor time until it has ended is what
/// counts; wall time is that of the machine as it is.
void run_cancel(int times) {
  using Clock = std::chrono::steady_clock;
  const auto ms_since = [](Clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
  };
  const BenchCase bench_case = synthetic_case(0);
  std::mt19937 generator(1);
  const SE3 start = random_start(bench_case.T_camera_lidar, generator, 5.0);
  const auto run = [&](const std::stop_token& stop) {
    return calibration::calibrate(bench_case.scenes, bench_case.intrinsics, start, {}, stop);
  };
  const auto whole_begin = Clock::now();
  (void)run({});
  const double whole_ms = ms_since(whole_begin);
  std::vector<double> wall_ms;
  std::vector<double> processor_ms;
  for (int i = 0; i < times; ++i) {
    Clock::time_point ended;
    double ended_s = 0.0;
    std::jthread thread([&](const std::stop_token& stop) {
      (void)run(stop);
      ended = Clock::now();
      ended_s = thread_seconds();
    });
    clockid_t clock{};
    pthread_getcpuclockid(thread.native_handle(), &clock);
    std::this_thread::sleep_for(
        std::chrono::duration<double, std::milli>(whole_ms * (i + 0.5) / times));
    const double asked_s = seconds_of(clock);
    const auto asked = Clock::now();
    thread.request_stop();
    thread.join();
    if (ended < asked) continue;
    wall_ms.push_back(std::chrono::duration<double, std::milli>(ended - asked).count());
    processor_ms.push_back(1e3 * (ended_s - asked_s));
  }
  std::printf(
      "within a calibration of %.1f s, cancelled %zu times\n\n"
      "| until it has ended | median ms | p95 ms | max ms |\n| --- | --- | --- | --- |\n",
      1e-3 * whole_ms,
      wall_ms.size());
  const auto print = [](const char* name, const std::vector<double>& values_ms) {
    std::printf("| %s | %.1f | %.1f | %.1f |\n",
                name,
                quantile(values_ms, 0.5),
                quantile(values_ms, 0.95),
                quantile(values_ms, 1.0));
  };
  print("processor time", processor_ms);
  print("wall time", wall_ms);
}

int run(int argc, char** argv) {
  const std::string mode = argc > 1 ? argv[1] : "synthetic";
  Work work;
  if (mode == "real") {
    work.starts = 50;
    work.max_deg = 3.0;
    work.limits = {0.3, 0.5};
  } else if (mode == "camvox") {
    work.starts = 3;
    work.max_deg = 2.0;
    work.config.method = "camvox";
  }
  if (argc > 2) work.starts = std::atoi(argv[2]);
  if (argc > 3) work.max_deg = std::atof(argv[3]);
  if (argc > 4) work.first = static_cast<std::size_t>(std::atoi(argv[4]));
  if (argc > 5) work.count = static_cast<std::size_t>(std::atoi(argv[5]));
  if (mode == "cancel") {
    run_cancel(work.starts);
  } else if (mode == "camvox") {
    run_camvox(work);
  } else if (mode == "real") {
    run_all(work, real_count(), real_case);
  } else {
    run_all(work, synthetic_count(), synthetic_case);
  }
  return 0;
}

}  // namespace
}  // namespace camvox::bench

int main(int argc, char** argv) { return camvox::bench::run(argc, argv); }
