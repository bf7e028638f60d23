#include <fmt/format.h>

#include "camvox/storage/cdr_value.hpp"
#include "topic.hpp"
#include "topic_messages.hpp"
#include "topic_reader.hpp"

namespace camvox::command {
namespace {

/// The part of a message that --field names.
storage::CdrValue part_of(const storage::CdrValue& message, const TopicOptions& options) {
  if (options.field.empty()) return message;
  const auto part = message.at(options.field);
  if (!part) {
    throw CommandError(
        fmt::format("messages of {} have no field '{}'", options.topic, options.field));
  }
  return *part;
}

void print(const storage::CdrValue& value, const TopicOptions& options) {
  storage::YamlStyle style;
  style.max_array_length = static_cast<std::size_t>(options.max_elements);
  style.hide_arrays = options.no_arrays;
  std::string text = storage::to_yaml(value, style);
  if (!text.ends_with('\n')) text += '\n';
  fmt::print("{}---\n", text);
  std::fflush(stdout);
}

}  // namespace

int topic_echo(const CommonOptions& common, const TopicOptions& options) {
  const Session session(common);
  const auto topic = find_published_topic(session, options.topic);
  const MessageDecoder decoder(topic.type_name);
  const int wanted = options.once ? 1 : options.messages;
  int printed = 0;
  TopicReader* running = nullptr;
  TopicReader reader(session, topic, [&](const Sample<RawMessage>& message) {
    if (wanted > 0 && printed == wanted) return;
    print(part_of(decoder.decode(*message), options), options);
    if (++printed == wanted) running->done();
  });
  running = &reader;
  reader.run();
  return Exit::kDone;
}

}  // namespace camvox::command
