#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "camvox/dds/executor.hpp"
#include "camvox/dds/participant.hpp"
#include "camvox/interfaces/message_type.hpp"

namespace camvox::dds {

/// Request/reply over two topics, as rmw_fastrtps does it: "rq/<name>Request" and
/// "rr/<name>Reply", the reply related to its request by the sample identity.
/// (Derived from rmw_fastrtps' documented behaviour; not run against ROS 2 itself.)
class ServiceServer {
 public:
  using Handler = std::function<void(const void* request, void* response)>;

  /// The handler runs on the executor's thread; its exceptions go to the tenant. The executor
  /// must outlive the server.
  ServiceServer(std::shared_ptr<Participant> participant,
                Executor& executor,
                const std::shared_ptr<Tenant>& tenant,
                const std::string& name,
                const interfaces::MessageType& request_type,
                const interfaces::MessageType& response_type,
                Handler handler);
  ServiceServer(const ServiceServer&) = delete;
  ServiceServer& operator=(const ServiceServer&) = delete;
  ~ServiceServer();

  /// No handler begins any more. False: one runs that did not return in time.
  [[nodiscard]] bool end(std::chrono::milliseconds timeout);

 private:
  struct Implementation;
  Executor& executor_;
  std::shared_ptr<Tenant> tenant_;  // of its own, so that it can end alone
  std::shared_ptr<Implementation> implementation_;
};

/// Serves `name` ("/camvox/_container/list_nodes") with a typed handler on the executor's thread.
template <typename Request, typename Response>
std::unique_ptr<ServiceServer> serve(const std::shared_ptr<Participant>& participant,
                                     Executor& executor,
                                     const std::shared_ptr<Tenant>& tenant,
                                     const std::string& name,
                                     std::function<void(const Request&, Response&)> handler) {
  return std::make_unique<ServiceServer>(participant,
                                         executor,
                                         tenant,
                                         name,
                                         interfaces::message_type<Request>(),
                                         interfaces::message_type<Response>(),
                                         [handler](const void* request, void* response) {
                                           handler(*static_cast<const Request*>(request),
                                                   *static_cast<Response*>(response));
                                         });
}

/// Calls a service and waits for the answer. Returns false if no server answered in time (also
/// when there is none); the response is then untouched.
[[nodiscard]] bool call_service(const std::shared_ptr<Participant>& participant,
                                const std::string& name,
                                const interfaces::MessageType& request_type,
                                const void* request,
                                const interfaces::MessageType& response_type,
                                void* response,
                                std::chrono::milliseconds timeout);

template <typename Request, typename Response>
[[nodiscard]] bool call(const std::shared_ptr<Participant>& participant,
                        const std::string& name,
                        const Request& request,
                        Response& response,
                        std::chrono::milliseconds timeout) {
  return call_service(participant,
                      name,
                      interfaces::message_type<Request>(),
                      &request,
                      interfaces::message_type<Response>(),
                      &response,
                      timeout);
}

}  // namespace camvox::dds
