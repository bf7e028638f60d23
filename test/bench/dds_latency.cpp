// Latency and cost of one hop, as a Markdown table: from just before publish() to the sample in the
// reader's callback. Usage: dds_latency [messages per row]
//
// Paths: loaned samples inside a container, loaned across processes (zero_copy: interprocess),
// serialised over shared memory, serialised over UDP. The message is a DepthImage of 16 MiB
// capacity, of which the given size is used and was just written; the reader does not look at it.
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <mutex>
#include <optional>

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/test/child_process.hpp"
#include "camvox/test/dds_domain.hpp"
#include "camvox/test/deadline.hpp"
#include "camvox/test/test_container.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::DepthImage;
using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""us;

constexpr Port kPort{"depth", topics::kDepthImage};
constexpr std::uint64_t kWarmUp = 20;
constexpr int kCostMessages = 50;
constexpr auto kCostPeriod = 100ms;

std::int64_t steady_now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

double cpu_time_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

struct Path {
  const char* name;
  const char* transport;  ///< Of both sides; "": reader in the writer's container.
  std::chrono::microseconds period;
  std::chrono::microseconds period_of_large;  ///< From 1 MB: serialised, 16 MB take 20 ms.
};
constexpr Path kPaths[] = {{"loaned, in container, warm", "", 500us, 500us},
                           {"loaned, in container", "", 10ms, 10ms},
                           {"loaned, across processes", "shared", 10ms, 10ms},
                           {"serialised, shared memory", "shm", 10ms, 60ms},
                           {"serialised, UDP", "udp", 10ms, 60ms}};

struct Size {
  const char* name;
  std::uint32_t bytes;
};
constexpr Size kSizes[] = {
    {"1 KB", 1'000}, {"64 KB", 64'000}, {"2.6 MB", 2'600'000}, {"16 MB", 16'000'000}};

dds::ParticipantOptions options_for(int domain_id, const std::string& transport) {
  dds::ParticipantOptions options;
  options.domain_id = domain_id;
  options.udp = transport != "shm";
  options.shared_memory = transport != "udp";
  return options;
}

dds::TopicSettingsMap topics_for(const std::string& transport) {
  dds::TopicSettingsMap topics;
  topics[std::string(topics::kDepthImage)].interprocess_zero_copy = transport == "shared";
  return topics;
}

/// Collects the age of every message.
class Ages {
 public:
  void subscribe(Context& context) {
    context.subscribe<DepthImage>(kPort, [this](const Sample<DepthImage>& image) {
      const auto age_ns = steady_now_ns() - image->header().stamp_ns();
      const std::lock_guard lock(mutex_);
      last_ = image->header().frame_id();
      if (last_ > kWarmUp) ages_ns_.push_back(age_ns);
    });
  }
  [[nodiscard]] std::uint64_t last() const {
    const std::lock_guard lock(mutex_);
    return last_;
  }
  /// "<count> <p50> <p99> <max>" in us; forgets everything.
  [[nodiscard]] std::string summary() {
    const std::lock_guard lock(mutex_);
    auto ages = std::exchange(ages_ns_, {});
    last_ = 0;
    std::sort(ages.begin(), ages.end());
    if (ages.empty()) return "0 nan nan nan";
    const auto at = [&](double share) {
      const auto rank = static_cast<std::size_t>(share * static_cast<double>(ages.size() - 1));
      return static_cast<double>(ages[rank]) * 1e-3;
    };
    return fmt::format("{} {:.0f} {:.0f} {:.0f}", ages.size(), at(0.5), at(0.99), at(1.0));
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::int64_t> ages_ns_;
  std::uint64_t last_ = 0;
};

/// The reader in another process: answers "summary", "last" and "cpu".
int run_reader(int domain_id, const std::string& transport) {
  Ages ages;
  test::TestContainer container(options_for(domain_id, transport), topics_for(transport));
  ages.subscribe(container.component());
  container.activate();
  for (std::string order; std::getline(std::cin, order) && order != "quit";) {
    if (order == "cpu") fmt::print("cpu {:.6f};\n", cpu_time_s());
    if (order == "summary") fmt::print("summary {};\n", ages.summary());
    if (order == "last") fmt::print("last {};\n", ages.last());
    std::fflush(stdout);
  }
  return 0;
}

/// The reader, wherever it is.
class Reader {
 public:
  Reader(test::TestContainer& container, const Path& path, const char* program) {
    if (*path.transport == '\0') {
      ages_.subscribe(container.component("reader"));
    } else {
      const auto domain = std::to_string(test::own_domain());
      child_.emplace(std::vector<std::string>{program, "--reader", domain, path.transport});
    }
  }
  ~Reader() {
    if (child_) child_->tell("quit");
    if (child_) (void)child_->wait();
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  std::uint64_t last() { return child_ ? std::stoull(ask("last")) : ages_.last(); }
  std::string summary() { return child_ ? ask("summary") : ages_.summary(); }
  double cpu_s() { return child_ ? std::stod(ask("cpu")) : 0.0; }

 private:
  std::string ask(const std::string& order) {
    const std::size_t before = child_->output().size();
    child_->tell(order);
    (void)test::wait_until([&] { return child_->output().find(';', before) != std::string::npos; });
    const std::string answer = child_->output().substr(before);
    const auto start = answer.find(order + " ") + order.size() + 1;
    return answer.substr(start, answer.find(';') - start);
  }

  Ages ages_;
  std::optional<test::ChildProcess> child_;
};

/// Sends one message and returns the moment before it went.
void send(Publisher<DepthImage>& publisher, std::uint64_t frame, std::uint32_t bytes, bool fill) {
  auto image = publisher.loan();
  const std::uint32_t floats = bytes / 4;
  const auto capacity = static_cast<std::uint32_t>(image->depth_m().size());
  image->depth_m_count() = std::min(floats, capacity);
  image->sigma_m_count() = floats - image->depth_m_count();
  if (fill) std::fill_n(image->depth_m().begin(), image->depth_m_count(), 1.0F);
  if (fill) std::fill_n(image->sigma_m().begin(), image->sigma_m_count(), 0.1F);
  image->header().frame_id(frame);
  image->header().stamp_ns(steady_now_ns());
  publisher.publish(std::move(image));
}

/// Sends `count` messages at that period; false if the last one never arrived.
bool send_all(Publisher<DepthImage>& publisher,
              Reader& reader,
              std::uint32_t bytes,
              std::pair<std::uint64_t, std::chrono::microseconds> count_and_period,
              bool fill) {
  auto next = std::chrono::steady_clock::now();
  for (std::uint64_t frame = 1; frame <= count_and_period.first; ++frame) {
    std::this_thread::sleep_until(next += count_and_period.second);
    send(publisher, frame, bytes, fill);
  }
  return test::wait_until([&] { return reader.last() == count_and_period.first; },
                          std::chrono::seconds(10));
}

/// CPU time of both processes for each message at 10 Hz, with the content already there.
double cost_per_message_us(Publisher<DepthImage>& publisher, Reader& reader, std::uint32_t bytes) {
  const double before_s = cpu_time_s() + reader.cpu_s();
  auto next = std::chrono::steady_clock::now();
  for (int i = 0; i < kCostMessages; ++i) {
    std::this_thread::sleep_until(next += kCostPeriod);
    send(publisher, static_cast<std::uint64_t>(i) + 1, bytes, false);
  }
  std::this_thread::sleep_until(next + kCostPeriod);
  const double spent_s = cpu_time_s() + reader.cpu_s() - before_s;
  (void)reader.summary();
  return spent_s / kCostMessages * 1e6;
}

void measure(const Path& path, std::uint64_t messages, const char* program) {
  test::TestContainer container(options_for(test::own_domain(), path.transport),
                                topics_for(path.transport));
  auto publisher = container.component("writer").advertise<DepthImage>(kPort);
  Reader reader(container, path, program);
  container.activate();
  if (!test::wait_until([&] { return publisher.subscriber_count() > 0; })) {
    fmt::print("| {} | no reader found | | | | | |\n", path.name);
    return;
  }
  for (const auto& size : kSizes) {
    const auto period = size.bytes < 1'000'000 ? path.period : path.period_of_large;
    const bool complete =
        send_all(publisher, reader, size.bytes, {messages + kWarmUp, period}, true);
    std::istringstream numbers(reader.summary());
    std::string count, p50, p99, largest;
    numbers >> count >> p50 >> p99 >> largest;
    const double cost_us = cost_per_message_us(publisher, reader, size.bytes);
    fmt::print("| {} | {} | {} | {} | {} | {}{} | {:.0f} |\n",
               path.name,
               size.name,
               p50,
               p99,
               largest,
               count,
               complete ? "" : " (last one lost)",
               cost_us);
    std::fflush(stdout);
  }
}

int run(std::uint64_t messages, const char* program) {
  fmt::print("{} messages a row. CPU: both processes, at 10 Hz, without writing the content.\n\n",
             messages);
  fmt::print("| path | size | p50 us | p99 us | max us | received | CPU us a message |\n");
  fmt::print("| --- | --- | ---: | ---: | ---: | ---: | ---: |\n");
  for (const auto& path : kPaths) measure(path, messages, program);
  return 0;
}

}  // namespace
}  // namespace camvox

int main(int argc, char** argv) {
  if (argc == 4 && std::string(argv[1]) == "--reader") {
    return camvox::run_reader(std::stoi(argv[2]), argv[3]);
  }
  return camvox::run(argc > 1 ? std::stoull(argv[1]) : 200, argv[0]);
}
