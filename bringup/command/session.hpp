#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "camvox/bringup/console_logger.hpp"
#include "camvox/dds/participant.hpp"
#include "camvox/dds/service.hpp"
#include "command.hpp"

namespace camvox::command {

/// A visit to a DDS domain: what is there, and calls to it.
class Session {
 public:
  using Endpoints = std::vector<dds::DiscoveredEndpoint>;

  explicit Session(const CommonOptions& options);

  [[nodiscard]] const std::shared_ptr<dds::Participant>& participant() const {
    return participant_;
  }
  [[nodiscard]] std::string domain_text() const;

  /// Looks until `found` is true, for at most the timeout.
  bool look_for(const std::function<bool(const Endpoints&)>& found) const;
  /// What is on the domain, once nothing new has come for a while.
  [[nodiscard]] Endpoints settled() const;

  /// Servers of `/<owner><suffix>`, e.g. all containers with suffix "/_container/list_nodes".
  [[nodiscard]] std::vector<std::string> owners_of(const std::string& suffix,
                                                   const Endpoints& endpoints) const;

  /// Calls a service; throws CommandError if nobody serves it, or the answer does not come.
  template <typename Request, typename Response>
  Response call(const std::string& service, const Request& request) const {
    require_service(service);
    Response response;
    if (!dds::call(participant_, service, request, response, kAnswerTimeout)) no_answer(service);
    return response;
  }

 private:
  static constexpr std::chrono::seconds kAnswerTimeout{10};  // a component may take its time

  void require_service(const std::string& service) const;
  [[noreturn]] void no_answer(const std::string& service) const;

  std::shared_ptr<bringup::ConsoleLogger> log_;
  std::chrono::milliseconds timeout_;
  std::shared_ptr<dds::Participant> participant_;
};

/// "camvox" and "/camvox" both name "/camvox".
[[nodiscard]] std::string with_slash(const std::string& name);

}  // namespace camvox::command
