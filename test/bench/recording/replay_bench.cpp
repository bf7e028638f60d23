// Publish jitter of a replay in real time: a recording of a full rig (10 Hz raw images of 1520x568,
// 10 Hz scans of 24 000 points, 200 Hz IMU) goes out over DDS to a reader on another participant.
// Printed per topic, in ms: how much later than its time each publish began, and the same at the
// reader. Usage: replay_bench [seconds, default 20]
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <mutex>

#include "camvox/recording/player.hpp"
#include "camvox/storage/bag_writer.hpp"
#include "camvox/test/test_container.hpp"

namespace camvox {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;

struct Stream {
  const char* topic;
  const char* type;
  std::size_t bytes;
  std::int64_t period_ns;
};
constexpr Stream kStreams[] = {
    {"/camera/image_raw", "sensor_msgs/msg/Image", 2'590'160, 100'000'000},
    {"/livox/lidar", "livox_ros_driver2/msg/CustomMsg", 480'080, 100'000'000},
    {"/livox/imu", "sensor_msgs/msg/Imu", 324, 5'000'000}};

void require(const storage::Status& status) {
  if (!status.ok()) throw std::runtime_error(status.message());
}

void write_bag(const std::filesystem::path& folder, double seconds) {
  auto bag = storage::BagWriter::create(folder);
  require(bag.status());
  std::vector<std::size_t> numbers;
  std::vector<std::vector<std::byte>> messages;
  for (const auto& stream : kStreams) {
    storage::BagTopic topic;
    topic.name = stream.topic;
    topic.type = stream.type;
    const auto number = (*bag)->add_topic(topic);
    require(number.status());
    numbers.push_back(*number);
    messages.emplace_back(stream.bytes)[1] = std::byte{1};  // CDR, little-endian
  }
  for (std::int64_t t = 0; t < std::llround(seconds * 1e9); t += 5'000'000) {
    for (std::size_t i = 0; i < std::size(kStreams); ++i) {
      if (t % kStreams[i].period_ns != 0) continue;
      require((*bag)->write(numbers[i], kStart_ns + t, kStart_ns + t, messages[i]));
    }
  }
  require((*bag)->close());
}

/// Lateness in ms by number of the stream; from several threads.
class Lateness {
 public:
  void add(std::size_t stream, std::int64_t since_start_ns) {
    const auto now = Clock::now();
    const std::lock_guard lock(mutex_);
    if (!start_) start_ = now;
    const std::chrono::duration<double, std::milli> late =
        now - (*start_ + std::chrono::nanoseconds(since_start_ns));
    values_[stream].push_back(late.count());
  }
  void print(const char* where) {
    for (auto& [stream, values] : values_) {
      // The first message sets the time; what was earlier than that makes the others later.
      const double earliest = *std::min_element(values.begin(), values.end());
      std::sort(values.begin(), values.end());
      const auto at = [&](double share) {
        return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))] -
               earliest;
      };
      fmt::print("{:10} {:20} {:6} messages  p50 {:7.3f}  p99 {:7.3f}  max {:7.3f} ms\n",
                 where,
                 kStreams[stream].topic,
                 values.size(),
                 at(0.5),
                 at(0.99),
                 at(1.0));
    }
  }

 private:
  std::mutex mutex_;
  std::optional<Clock::time_point> start_;
  std::map<std::size_t, std::vector<double>> values_;
};

void measure(const std::filesystem::path& folder) {
  test::TestContainer sender(test::test_options("sender"));
  test::TestContainer receiver(test::test_options("receiver"));
  auto& out = sender.component("replay");
  auto& in = receiver.component("reader");
  Lateness at_publish, at_reader;
  std::vector<Publisher<RawMessage>> publishers;
  for (std::size_t i = 0; i < std::size(kStreams); ++i) {
    const auto& stream = kStreams[i];
    publishers.push_back(out.advertise_raw(
        {"out", stream.topic}, stream.type, {.qos = {.depth = 64}, .max_loans = 2}));
    in.subscribe_raw({"in", stream.topic},
                     stream.type,
                     [&at_reader, i, count = std::int64_t{0}](const Sample<RawMessage>&) mutable {
                       at_reader.add(i, count++ * kStreams[i].period_ns);
                     },
                     {.qos = {.depth = 64}});
  }
  sender.activate();
  receiver.activate();
  for (const auto& publisher : publishers) {
    while (publisher.subscriber_count() == 0) usleep(10'000);
  }
  auto bag = storage::BagReader::open(folder);
  require(bag.status());
  recording::Player player(std::move(*bag), {}, [&](recording::PlayedMessage&& message) {
    at_publish.add(message.topic, message.log_time_ns - kStart_ns);
    auto loan = publishers[message.topic].loan();
    loan->cdr = std::move(message.cdr);
    publishers[message.topic].publish(std::move(loan));
  });
  player.start();
  player.wait_until_finished();
  usleep(500'000);
  receiver.remove(in);
  at_publish.print("publish");
  at_reader.print("reader");
}

}  // namespace
}  // namespace camvox

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 20.0;
  const auto folder =
      std::filesystem::temp_directory_path() / ("camvox_replay_bench_" + std::to_string(getpid()));
  camvox::write_bag(folder, seconds);
  camvox::measure(folder);
  std::filesystem::remove_all(folder);
}
