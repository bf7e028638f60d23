#include "topic.hpp"

namespace camvox::command {

int topic_echo(const CommonOptions&, const TopicOptions&) { throw CommandError("later"); }

}  // namespace camvox::command
