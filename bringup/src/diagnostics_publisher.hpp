#pragma once

#include <string>
#include <vector>

#include "camvox/component/context.hpp"
#include "camvox/interfaces/diagnostic_msgs.hpp"

namespace camvox::bringup {

/// Publishes the health of a container's components on /diagnostics.
class DiagnosticsPublisher {
 public:
  struct Entry {
    std::string component;
    Diagnostics::Status status;
  };

  DiagnosticsPublisher(Context& context, std::string container);
  void publish(const std::vector<Entry>& entries);

 private:
  Context& context_;
  std::string container_;
  Publisher<diagnostic_msgs::msg::DiagnosticArray> publisher_;
};

}  // namespace camvox::bringup
