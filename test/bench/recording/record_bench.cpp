// Recording at full sensor rate: another process publishes 10 Hz images of 1520x568 in colour, 10
// Hz scans of 24 000 points, 200 Hz IMU, and all internal topics at their rates; this one records
// everything. Printed per topic: sent, in the bag. Exit code 1 if a message is not in the bag.
// Usage: record_bench [seconds, default 20] [folder of the bag, default a temporary one]
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <map>
#include <sstream>

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/livox_ros_driver2.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/recording/record_component.hpp"
#include "camvox/storage/bag_reader.hpp"
#include "camvox/test/child_process.hpp"
#include "camvox/test/test_container.hpp"

namespace camvox {
namespace {

using namespace std::chrono_literals;
namespace msg = camvox_interfaces::msg;
constexpr std::uint32_t kPixels = 1520 * 568;
constexpr std::uint32_t kPoints = 24'000;

/// Says how many rows each list has, and leaves the rows as they are.
struct RowCount {
  std::uint32_t rows;
  template <typename Member>
  void fixed(Member&) {}
  template <typename Array>
  void list(Array& array, std::uint32_t& count) {
    count = std::min(rows, static_cast<std::uint32_t>(array.size()));
  }
};

/// Publishes everything, counts what it sent.
class Rig {
 public:
  Rig(Context& context, double seconds) : context_(context), seconds_(seconds) {
    plain<msg::FrameImage>(topics::kFrameImage, 10, 3 * kPixels / 2);
    plain<msg::Scan>(topics::kScan, 10, kPoints);
    plain<msg::Cloud>(topics::kCloud, 10, kPoints);
    plain<msg::DepthImage>(topics::kDepthImage, 10, kPixels);
    plain<msg::FramePose>(topics::kFramePose, 10, 1);
    plain<msg::Keyframe>(topics::kKeyframe, 2, 2000);
    plain<msg::LocalMap>(topics::kLocalMap, 10, 8000);
    plain<msg::MapUpdate>(topics::kMapUpdate, 2, 1000);
    plain<msg::Progress>(topics::kProgress, 50, 1);
    ros<sensor_msgs::msg::Image>(
        topics::kImage, 10, [](auto& image) { image.data().resize(3 * kPixels); });
    ros<livox_ros_driver2::msg::CustomMsg>(
        topics::kLidar, 10, [](auto& scan) { scan.points().resize(kPoints); });
    ros<sensor_msgs::msg::Imu>(topics::kImu, 200, [](auto&) {});
  }

  [[nodiscard]] bool everybody_listens() const {
    return std::all_of(
        listeners_.begin(), listeners_.end(), [](const auto& count) { return count() > 0; });
  }
  [[nodiscard]] bool done() const {
    return std::all_of(
        left_.begin(), left_.end(), [](const auto& left) { return left.second == 0; });
  }
  void begin() { sending_ = true; }
  [[nodiscard]] const std::map<std::string, std::uint64_t>& sent() const { return sent_; }

 private:
  template <typename T>
  Publisher<T> publisher(std::string_view topic, double rate_hz) {
    auto made = context_.advertise<T>({std::string(topic), topic}, {.qos = qos::kKeyframes});
    listeners_.push_back([made] { return made.subscriber_count(); });
    left_[std::string(topic)] = static_cast<int>(seconds_ * rate_hz);
    return made;
  }
  void every(std::string_view topic, double rate_hz, std::function<void()> send) {
    const std::chrono::nanoseconds period(static_cast<std::int64_t>(1e9 / rate_hz));
    context_.every(period, [this, name = std::string(topic), send] {
      if (!sending_ || left_[name] == 0) return;
      --left_[name];
      send();
      ++sent_[name];
    });
  }
  template <typename T>
  void plain(std::string_view topic, double rate_hz, std::uint32_t rows) {
    auto out = publisher<T>(topic, rate_hz);
    every(topic, rate_hz, [out, rows]() mutable {
      auto loan = out.loan();
      interfaces::PlainLayout<T>::visit(*loan, RowCount{rows});
      out.publish(std::move(loan));
    });
  }
  template <typename T, typename Fill>
  void ros(std::string_view topic, double rate_hz, Fill fill) {
    auto out = publisher<T>(topic, rate_hz);
    every(topic, rate_hz, [out, fill]() mutable {
      auto loan = out.loan();
      fill(*loan);
      out.publish(std::move(loan));
    });
  }

  Context& context_;
  double seconds_;
  std::atomic<bool> sending_ = false;
  std::vector<std::function<std::size_t()>> listeners_;
  std::map<std::string, int> left_;
  std::map<std::string, std::uint64_t> sent_;
};

int send(double seconds, int domain_id) {
  auto options = test::test_options("rig");
  options.domain_id = domain_id;
  test::TestContainer container(options);
  auto& context = container.component("rig");
  Rig rig(context, seconds);
  container.activate();
  while (!rig.everybody_listens()) usleep(20'000);
  rig.begin();
  usleep(static_cast<useconds_t>(1e6 * seconds));
  while (!rig.done()) usleep(50'000);
  usleep(2'000'000);  // what is on its way arrives
  for (const auto& [topic, count] : rig.sent()) fmt::print("sent {} {}\n", topic, count);
  for (const auto& error : container.errors()) fmt::print(stderr, "error: {}\n", error);
  return 0;
}

double cpu_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

int record(const char* program, double seconds, const std::filesystem::path& folder) {
  const auto options = test::test_options("recorder");
  const auto log = std::make_shared<test::MemoryLogger>();
  const auto middleware = dds::make_middleware(options, {}, *log);
  const auto executor = std::make_shared<dds::Executor>("recorder");
  dds::ComponentContext context(
      dds::ComponentSettings{"recorder", {{"output", {folder.string(), {}}}}, {}},
      middleware,
      executor,
      log,
      [](std::exception_ptr) {});
  RecordComponent recorder(context);
  context.activate();
  context.post([&] { recorder.start(); });
  executor->start();
  test::ChildProcess rig(
      {program, "--send", std::to_string(seconds), std::to_string(options.domain_id)});
  const int code = rig.wait(std::chrono::milliseconds(std::llround(1e3 * seconds)) + 120s);
  (void)context.deactivate(5s);
  (void)executor->stop(5s);
  const auto lost = recorder.lost();
  const auto status = recorder.finish();
  if (code != 0 || !status.ok()) {
    fmt::print("{}\n{}\n", status.message(), rig.output());
    return 1;
  }
  auto bag = storage::BagReader::open(folder);
  if (!bag.ok()) throw std::runtime_error(bag.status().message());
  std::map<std::string, std::uint64_t> recorded;
  for (const auto& topic : (*bag)->topics()) recorded[topic.name] = topic.message_count;
  std::istringstream lines(rig.output());
  std::uint64_t missing = 0;
  for (std::string word, topic; lines >> word;) {
    std::uint64_t sent = 0;
    if (word != "sent" || !(lines >> topic >> sent)) continue;
    fmt::print("{:24} sent {:6}  in the bag {:6}\n", topic, sent, recorded[topic]);
    missing += sent - std::min(sent, recorded[topic]);
  }
  fmt::print("{} missing, {} counted as lost, {:.1f} MB/s, {:.0f} % of a core\n",
             missing,
             lost,
             1e-6 * static_cast<double>((*bag)->size()) / seconds,
             100.0 * cpu_s() / seconds);
  return missing == 0 ? 0 : 1;
}

}  // namespace
}  // namespace camvox

int main(int argc, char** argv) {
  if (argc == 4 && std::string(argv[1]) == "--send") {
    return camvox::send(std::atof(argv[2]), std::atoi(argv[3]));
  }
  const double seconds = argc > 1 ? std::atof(argv[1]) : 20.0;
  const auto folder = argc > 2 ? std::filesystem::path(argv[2])
                               : std::filesystem::temp_directory_path() /
                                     ("camvox_record_bench_" + std::to_string(getpid()));
  const int code = camvox::record(argv[0], seconds, folder);
  std::filesystem::remove_all(folder);
  return code;
}
