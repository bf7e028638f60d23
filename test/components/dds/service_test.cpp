#include "camvox/dds/service.hpp"

#include <gmock/gmock.h>

#include <thread>

#include "camvox/interfaces/composition_interfaces.hpp"
#include "camvox/test/deadline.hpp"
#include "camvox/test/test_container.hpp"

namespace camvox::dds {
namespace {

using namespace std::chrono_literals;
using composition_interfaces::srv::UnloadNode_Request;
using composition_interfaces::srv::UnloadNode_Response;

constexpr auto kPatience = 20s;

/// Answers with the number that it is asked for; 13 is an exception.
class EchoServer {
 public:
  EchoServer()
      : participant_(Participant::create(test::test_options("server"), log_)),
        tenant_(std::make_shared<Tenant>("server", [this](std::exception_ptr) { ++errors; })),
        server_(serve<UnloadNode_Request, UnloadNode_Response>(
            participant_,
            executor_,
            tenant_,
            "/echo",
            [](const UnloadNode_Request& request, UnloadNode_Response& response) {
              if (request.unique_id() == 13) throw std::runtime_error("unlucky");
              response.error_message(std::to_string(request.unique_id()));
            })) {
    executor_.start();
  }

  std::atomic<int> errors = 0;

 private:
  test::MemoryLogger log_;
  std::shared_ptr<Participant> participant_;
  Executor executor_{"server"};
  std::shared_ptr<Tenant> tenant_;
  std::unique_ptr<ServiceServer> server_;
};

std::string ask(const std::shared_ptr<Participant>& participant,
                std::uint64_t number,
                std::chrono::milliseconds patience = kPatience) {
  UnloadNode_Request request;
  request.unique_id(number);
  UnloadNode_Response response;
  const bool answered = call(participant, "/echo", request, response, patience);
  return answered ? response.error_message() : "no answer";
}

TEST(Service, AnswersEveryoneWithTheAnswerToHisOwnQuestion) {
  constexpr int kClients = 3;
  constexpr int kCalls = 5;
  EchoServer server;
  std::atomic<int> right = 0;
  std::vector<std::thread> clients;
  for (int client = 0; client < kClients; ++client) {
    clients.emplace_back([&right, client] {
      test::MemoryLogger log;
      const auto participant = Participant::create(test::test_options("client"), log);
      for (int i = 0; i < kCalls; ++i) {
        const auto number = static_cast<std::uint64_t>(1000 * client + i);
        if (ask(participant, number) == std::to_string(number)) ++right;
      }
    });
  }
  for (auto& client : clients) client.join();
  EXPECT_EQ(right, kClients * kCalls);
}

TEST(Service, WithoutAServerThereIsNoAnswer) {
  test::MemoryLogger log;
  const auto participant = Participant::create(test::test_options("client"), log);
  EXPECT_EQ(ask(participant, 1, 300ms), "no answer");
}

TEST(Service, AnExceptionReachesTheTenantAndTheServerGoesOn) {
  EchoServer server;
  test::MemoryLogger log;
  const auto participant = Participant::create(test::test_options("client"), log);
  // A question that ran out of time before the two had found each other was never asked.
  ASSERT_TRUE(test::wait_until([&] {
    EXPECT_EQ(ask(participant, 13, 1s), "no answer");
    return server.errors > 0;
  }));
  const int errors = server.errors;
  EXPECT_EQ(ask(participant, 14), "14");
  EXPECT_EQ(server.errors, errors);
}

/// A component that answers with the number that it is asked for; 13 is an exception.
void serve_echo(ComponentContext& context) {
  context.serve<UnloadNode_Request, UnloadNode_Response>(
      {"echo", "/echo"}, [](const UnloadNode_Request& request, UnloadNode_Response& response) {
        response.error_message(std::to_string(request.unique_id()));
        if (request.unique_id() == 13) throw std::runtime_error("unlucky");
      });
}

TEST(ComponentService, AnswersOnceTheComponentIsActive) {
  test::TestContainer container;
  auto& component = container.component();
  serve_echo(component);
  test::MemoryLogger log;
  const auto client = Participant::create(test::test_options("client"), log);
  EXPECT_EQ(ask(client, 1, 300ms), "no answer");
  container.activate();
  EXPECT_EQ(ask(client, 2), "2");
  container.remove(component);
  EXPECT_EQ(ask(client, 3, 300ms), "no answer");
}

TEST(ComponentService, AnExceptionIsTheComponentsOwn) {
  test::TestContainer container;
  serve_echo(container.component());
  container.activate();
  test::MemoryLogger log;
  const auto client = Participant::create(test::test_options("client"), log);
  EXPECT_EQ(ask(client, 13), "13") << "the caller is answered all the same";
  EXPECT_THAT(container.errors(), ::testing::ElementsAre(::testing::HasSubstr("unlucky")));
}

}  // namespace
}  // namespace camvox::dds
