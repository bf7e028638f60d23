#pragma once

#include "camvox/bringup/probe.hpp"

namespace camvox::bringup {

/// A context that runs nothing: it answers from the config and writes down what was asked for.
class ProbeContext final : public Context {
 public:
  explicit ProbeContext(const ComponentConfig& config);

  [[nodiscard]] const std::string& name() const override { return config_.name; }
  [[nodiscard]] Logger& log() override;
  [[nodiscard]] Diagnostics& diagnostics() override { return diagnostics_; }
  [[nodiscard]] std::int64_t now_ns() const override { return 0; }
  [[nodiscard]] std::string topic_of(const Port& port) const override;
  void every(std::chrono::nanoseconds period, std::function<void()> callback) override;
  void post(std::function<void()> callback) override;

  /// Reports what shows only when the constructor is through: ports and parameters that it did
  /// not ask for.
  void check_complete();
  [[nodiscard]] ProbedComponent take_result();
  void report(const Location& location, const std::string& key, std::string message);

 protected:
  [[nodiscard]] const ParameterMap& given_parameters() const override { return config_.parameters; }
  void accept_parameters(ParameterMap effective, std::vector<Problem> problems) override;
  void accept_changes(ChangeHandler) override {}
  std::shared_ptr<PublisherBackend> make_publisher(const Port& port,
                                                   const MessageType& type,
                                                   const PublishOptions& options) override;
  Subscription make_subscription(const Port& port,
                                 const MessageType& type,
                                 Callback callback,
                                 const SubscribeOptions& options) override;
  std::shared_ptr<PublisherBackend> make_raw_publisher(const Port& port,
                                                       std::string_view type_name,
                                                       const PublishOptions& options) override;
  Subscription make_raw_subscription(const Port& port,
                                     std::string_view type_name,
                                     Callback callback,
                                     const SubscribeOptions& options) override;
  void make_service(const Port& port,
                    const MessageType& request,
                    const MessageType& response,
                    ServiceHandler handler) override;

 private:
  void record(
      const Port& port, std::string_view type_name, bool internal, bool is_output, bool required);

  const ComponentConfig& config_;
  Diagnostics diagnostics_;
  ProbedComponent result_;
  bool has_parameters_ = false;
};

}  // namespace camvox::bringup
