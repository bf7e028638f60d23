#include "topic.hpp"

#include <CLI/CLI.hpp>
#include <memory>

namespace camvox::command {
namespace {

using Function = int (*)(const CommonOptions&, const TopicOptions&);

/// Adds one verb of `camvox topic`.
class Verbs {
 public:
  Verbs(CLI::App& group, const CommonOptions& common, Action& action)
      : group_(group), common_(common), action_(action) {}

  CLI::App* add(const char* verb, const char* help, Function function) {
    auto* command = group_.add_subcommand(verb, help);
    command->fallthrough();
    command->callback([function, options = options_, &common = common_, &action = action_] {
      action = [function, options, &common] { return function(common, *options); };
    });
    return command;
  }
  CLI::App* add_for_topic(const char* verb, const char* help, Function function) {
    auto* command = add(verb, help, function);
    command->add_option("topic", options_->topic, "Its name, e.g. /camvox/odometry")->required();
    return command;
  }
  [[nodiscard]] TopicOptions& options() { return *options_; }

 private:
  CLI::App& group_;
  const CommonOptions& common_;
  Action& action_;
  std::shared_ptr<TopicOptions> options_ = std::make_shared<TopicOptions>();
};

void add_window(CLI::App* command, TopicOptions& options, const char* fallback) {
  command
      ->add_option("-w,--window",
                   options.window,
                   std::string("Messages to average over (default: ") + fallback + ")")
      ->check(CLI::PositiveNumber);
  command->add_option("-n,--messages", options.messages, "Stop after so many messages")
      ->check(CLI::PositiveNumber);
}

void add_echo(Verbs& verbs) {
  auto& options = verbs.options();
  auto* echo = verbs.add_for_topic("echo", "Print messages as YAML", topic_echo);
  echo->add_flag("--once", options.once, "Print the first message and exit");
  echo->add_option("-n,--messages", options.messages, "Stop after so many messages")
      ->check(CLI::PositiveNumber);
  echo->add_option("--field", options.field, "Print only this part, e.g. pose.pose.position");
  echo->add_flag("--no-arr", options.no_arrays, "Print arrays as their type and size");
  echo->add_option("-l,--truncate-length",
                   options.max_elements,
                   "Print at most so many elements of an array (default: 128)")
      ->check(CLI::NonNegativeNumber);
}

}  // namespace

void add_topic(CLI::App& app, const CommonOptions& common, Action& action) {
  auto* group = app.add_subcommand("topic", "Topics: what there is, what flows, how fast");
  group->require_subcommand(1)->fallthrough();
  Verbs verbs(*group, common, action);
  auto& options = verbs.options();

  auto* list = verbs.add("list", "List the topics", topic_list);
  list->add_flag("-t,--show-types", options.show_types, "With their types");
  list->add_flag("-c,--count-topics", options.count_only, "Only how many there are");
  list->add_flag("--include-hidden-topics", options.hidden, "Also those with a part like /_this");
  auto* info = verbs.add_for_topic("info", "Print type, publishers and subscribers", topic_info);
  info->add_flag("-v,--verbose", options.verbose, "With every endpoint and its QoS");
  verbs.add_for_topic("type", "Print the type", topic_type);
  add_window(verbs.add_for_topic("hz", "Measure the rate", topic_hz), options, "10000");
  add_window(verbs.add_for_topic("bw", "Measure the data rate", topic_bw), options, "100");
  add_window(verbs.add_for_topic("delay", "Measure the delay since header.stamp", topic_delay),
             options,
             "10000");
  add_echo(verbs);
}

}  // namespace camvox::command
