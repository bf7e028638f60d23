#include "diagnostics_publisher.hpp"

#include "camvox/interfaces/header.hpp"

namespace camvox::bringup {
namespace {

using diagnostic_msgs::msg::DiagnosticArray;
using diagnostic_msgs::msg::DiagnosticStatus;

DiagnosticStatus to_message(const DiagnosticsPublisher::Entry& entry,
                            const std::string& container) {
  DiagnosticStatus message;
  message.level(static_cast<std::uint8_t>(entry.status.level));
  message.name(container + ": " + entry.component);
  message.message(entry.status.message);
  message.hardware_id(container);
  for (const auto& [key, value] : entry.status.values) {
    message.values().emplace_back();
    message.values().back().key(key);
    message.values().back().value(value);
  }
  return message;
}

}  // namespace

DiagnosticsPublisher::DiagnosticsPublisher(Context& context, std::string container)
    : context_(context),
      container_(std::move(container)),
      publisher_(context.advertise<DiagnosticArray>({"diagnostics", topics::kDiagnostics},
                                                    {.qos = qos::kDiagnostics})) {}

void DiagnosticsPublisher::publish(const std::vector<Entry>& entries) {
  auto message = publisher_.loan();
  message->header(interfaces::to_header(context_.now_ns(), ""));
  for (const auto& entry : entries) message->status().push_back(to_message(entry, container_));
  publisher_.publish(std::move(message));
}

}  // namespace camvox::bringup
