#include <fmt/format.h>

#include "running_statistics.hpp"
#include "topic.hpp"
#include "topic_messages.hpp"
#include "topic_reader.hpp"

namespace camvox::command {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

double now_s() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

std::int64_t wall_now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// Reads a topic with a print every second and one at the end, if there is news.
template <typename OnMessage, typename Print>
int measure(const TopicOptions& options,
            const Session& session,
            const dds::TopicEndpoints& topic,
            OnMessage on_message,
            Print print) {
  int messages = 0;
  int printed = 0;
  const auto print_news = [&] {
    if (messages == printed) return;
    printed = messages;
    print();
    std::fflush(stdout);
  };
  TopicReader* running = nullptr;
  TopicReader reader(session, topic, [&](const Sample<RawMessage>& message) {
    if (options.messages > 0 && messages == options.messages) return;
    on_message(*message);
    if (++messages == options.messages) running->done();
  });
  running = &reader;
  reader.every(1s, print_news);
  reader.run();
  print_news();
  return Exit::kDone;
}

std::size_t window_of(const TopicOptions& options, int fallback) {
  return static_cast<std::size_t>(options.window > 0 ? options.window : fallback);
}

void print_spread(const char* what, double average, const Window& window) {
  fmt::print("{}: {:.3f}\n\tmin: {:.3f}s max: {:.3f}s std dev: {:.5f}s window: {}\n",
             what,
             average,
             window.min(),
             window.max(),
             window.standard_deviation(),
             window.size() + 1);
}

std::string human_size(double bytes) {
  if (bytes < 1e3) return fmt::format("{:.0f} B", bytes);
  if (bytes < 1e6) return fmt::format("{:.2f} KB", 1e-3 * bytes);
  return fmt::format("{:.2f} MB", 1e-6 * bytes);
}

/// header.stamp of either kind: of ROS 2 messages, and of our internal ones.
std::int64_t stamp_ns(const storage::CdrValue& message, const dds::TopicEndpoints& topic) {
  if (const auto stamp = storage::header_stamp_ns(message)) return *stamp;
  const auto internal = message.at("header.stamp_ns");
  if (internal && internal->as_integer()) return *internal->as_integer();
  throw CommandError("messages of type " + topic.type_name + " have no header.stamp");
}

}  // namespace

int topic_hz(const CommonOptions& common, const TopicOptions& options) {
  const Session session(common);
  const auto topic = find_published_topic(session, options.topic);
  Window periods_s(window_of(options, 10000));
  double previous_s = 0.0;
  return measure(
      options,
      session,
      topic,
      [&](const RawMessage&) {
        const double now = now_s();
        if (previous_s > 0.0) periods_s.add(now - previous_s);
        previous_s = now;
      },
      [&] {
        if (!periods_s.empty()) print_spread("average rate", 1.0 / periods_s.mean(), periods_s);
      });
}

int topic_bw(const CommonOptions& common, const TopicOptions& options) {
  const Session session(common);
  const auto topic = find_published_topic(session, options.topic);
  Window sizes(window_of(options, 100));
  Window times_s(window_of(options, 100));
  return measure(
      options,
      session,
      topic,
      [&](const RawMessage& message) {
        sizes.add(static_cast<double>(message.cdr.size()));
        times_s.add(now_s());
      },
      [&] {
        const double seconds = now_s() - times_s.front();
        fmt::print("{}/s from {} messages\n\tMessage size mean: {} min: {} max: {}\n",
                   human_size(sizes.sum() / std::max(seconds, 1e-9)),
                   sizes.size(),
                   human_size(sizes.mean()),
                   human_size(sizes.min()),
                   human_size(sizes.max()));
      });
}

int topic_delay(const CommonOptions& common, const TopicOptions& options) {
  const Session session(common);
  const auto topic = find_published_topic(session, options.topic);
  const MessageDecoder decoder(topic.type_name);
  Window delays_s(window_of(options, 10000));
  return measure(
      options,
      session,
      topic,
      [&](const RawMessage& message) {
        const auto now_ns = wall_now_ns();
        delays_s.add(1e-9 * static_cast<double>(now_ns - stamp_ns(decoder.decode(message), topic)));
      },
      [&] {
        if (!delays_s.empty()) print_spread("average delay", delays_s.mean(), delays_s);
      });
}

}  // namespace camvox::command
