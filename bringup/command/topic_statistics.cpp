#include <fmt/format.h>

#include <cstring>
#include <optional>

#include "running_statistics.hpp"
#include "topic.hpp"
#include "topic_reader.hpp"

namespace camvox::command {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

double now_s() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

double wall_now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// Reads a topic with a print every second and one at the end, if there is news.
template <typename OnMessage, typename Print>
int measure(const TopicOptions& options,
            const Session& session,
            const TopicInfo& topic,
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

/// The first field of a message definition: "std_msgs/Header header".
std::string first_field(std::string_view schema) {
  while (!schema.empty()) {
    const auto line = schema.substr(0, schema.find('\n'));
    schema.remove_prefix(std::min(schema.size(), line.size() + 1));
    const bool is_constant = line.find('=') != std::string_view::npos;
    if (!line.empty() && line.front() != '#' && !is_constant) return std::string(line);
  }
  return {};
}

/// Reads header.stamp from serialised messages of one type; throws if the type has none.
class StampReader {
 public:
  explicit StampReader(const std::string& type_name) {
    const auto* type = interfaces::find_message_type(type_name);
    if (type == nullptr) throw CommandError("type " + type_name + " is not known here");
    const auto field = first_field(type->schema);
    is_ns_ = field.starts_with("MessageHeader ");
    if (!is_ns_ && !field.starts_with("std_msgs/Header ") && !field.starts_with("Header ")) {
      throw CommandError("messages of type " + type_name + " have no header.stamp");
    }
  }

  [[nodiscard]] std::optional<double> stamp_s(const std::vector<std::uint8_t>& cdr) const {
    constexpr std::size_t kEncapsulation = 4;
    if (cdr.size() < kEncapsulation + 8) return std::nullopt;
    if (is_ns_) return 1e-9 * static_cast<double>(read<std::int64_t>(cdr, kEncapsulation));
    return static_cast<double>(read<std::int32_t>(cdr, kEncapsulation)) +
           1e-9 * static_cast<double>(read<std::uint32_t>(cdr, kEncapsulation + 4));
  }

 private:
  template <typename T>
  static T read(const std::vector<std::uint8_t>& cdr, std::size_t offset) {
    T value;
    std::memcpy(&value, cdr.data() + offset, sizeof(T));
    return value;
  }

  bool is_ns_ = false;
};

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
  const StampReader stamps(topic.type_name);
  Window delays_s(window_of(options, 10000));
  return measure(
      options,
      session,
      topic,
      [&](const RawMessage& message) {
        if (const auto stamp_s = stamps.stamp_s(message.cdr)) delays_s.add(wall_now_s() - *stamp_s);
      },
      [&] {
        if (!delays_s.empty()) print_spread("average delay", delays_s.mean(), delays_s);
      });
}

}  // namespace camvox::command
