#pragma once

#include <string>

#include "command.hpp"

namespace camvox::command {

struct TopicOptions {
  std::string topic;
  bool show_types = false;
  bool count_only = false;
  bool verbose = false;
  bool hidden = false;
  int window = 0;
  int messages = 0;  ///< Stop after so many; 0: at Ctrl-C.
  bool once = false;
  std::string field;
  bool no_arrays = false;
  int max_elements = 128;
};

int topic_list(const CommonOptions& common, const TopicOptions& options);
int topic_info(const CommonOptions& common, const TopicOptions& options);
int topic_type(const CommonOptions& common, const TopicOptions& options);
int topic_hz(const CommonOptions& common, const TopicOptions& options);
int topic_bw(const CommonOptions& common, const TopicOptions& options);
int topic_delay(const CommonOptions& common, const TopicOptions& options);
int topic_echo(const CommonOptions& common, const TopicOptions& options);

}  // namespace camvox::command
