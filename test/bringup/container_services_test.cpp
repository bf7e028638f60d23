#include <chrono>
#include <filesystem>
#include <future>

#include "camvox/bringup/parameter_messages.hpp"
#include "camvox/dds/service.hpp"
#include "camvox/interfaces/composition_interfaces.hpp"
#include "container_fixture.hpp"

namespace camvox::bringup {
namespace {

using namespace composition_interfaces::srv;
using namespace rcl_interfaces::srv;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Calls the services of a container as another process would.
class ContainerServicesTest : public ContainerFixture {
 protected:
  template <typename Request, typename Response>
  Response call(const std::string& service, const Request& request) {
    Response response;
    EXPECT_TRUE(dds::call(participant_, service, request, response, std::chrono::seconds(20)))
        << service;
    return response;
  }
  LoadNode_Response load(const LoadNode_Request& request) {
    return call<LoadNode_Request, LoadNode_Response>("/rig/_container/load_node", request);
  }
  static LoadNode_Request ticker(const std::string& name) {
    LoadNode_Request request;
    request.package_name("camvox_test");
    request.plugin_name("test::Ticker");
    request.node_name(name);
    return request;
  }
  static rcl_interfaces::msg::Parameter parameter(const std::string& name,
                                                  const config::Value& value) {
    rcl_interfaces::msg::Parameter message;
    message.name(name);
    message.value(to_message(value));
    return message;
  }
  SetParameters_Response set(const std::string& component,
                             const std::vector<rcl_interfaces::msg::Parameter>& parameters) {
    SetParameters_Request request;
    request.parameters(parameters);
    return call<SetParameters_Request, SetParameters_Response>(component + "/set_parameters",
                                                               request);
  }
  std::optional<config::Value> get(const std::string& component, const std::string& name) {
    GetParameters_Request request;
    request.names({name});
    const auto response =
        call<GetParameters_Request, GetParameters_Response>(component + "/get_parameters", request);
    EXPECT_EQ(response.values().size(), 1U);
    return from_message(response.values().at(0));
  }

  ConsoleLogger console_{"test", LogLevel::kWarn};
  std::shared_ptr<dds::Participant> participant_ = [this] {
    dds::ParticipantOptions options;
    options.domain_id = test::own_domain();
    return dds::Participant::create(options, console_);
  }();
};

TEST_F(ContainerServicesTest, LoadListUnload) {
  start("container: {name: rig}\ncomponents: []\n");
  auto request = ticker("first");
  request.remap_rules({"ticks:=/other"});
  request.parameters({parameter("fail_at", std::int64_t{0})});
  request.extra_arguments({parameter("on_error", std::string("restart"))});
  const auto loaded = load(request);
  EXPECT_TRUE(loaded.success()) << loaded.error_message();
  EXPECT_EQ(loaded.full_node_name(), "/first");
  EXPECT_EQ(loaded.unique_id(), 1U);

  const auto nodes = call<ListNodes_Request, ListNodes_Response>("/rig/_container/list_nodes", {});
  EXPECT_THAT(nodes.full_node_names(), ElementsAre("/first"));
  EXPECT_THAT(nodes.unique_ids(), ElementsAre(1U));

  UnloadNode_Request unload;
  unload.unique_id(1);
  EXPECT_TRUE((call<UnloadNode_Request, UnloadNode_Response>("/rig/_container/unload_node", unload)
                   .success()));
  const auto again =
      call<UnloadNode_Request, UnloadNode_Response>("/rig/_container/unload_node", unload);
  EXPECT_FALSE(again.success());
  EXPECT_EQ(again.error_message(), "No node found with unique_id: 1");
  EXPECT_THAT(container_->components(), IsEmpty());
}

TEST_F(ContainerServicesTest, LoadNamesAComponentAfterItsClass) {
  start("container: {name: rig}\ncomponents: []\n");
  EXPECT_EQ(load(ticker("")).full_node_name(), "/ticker");
}

TEST_F(ContainerServicesTest, LoadTellsWhatIsWrong) {
  start("container: {name: rig}\ncomponents:\n  - {plugin: test::Ticker, name: first}\n");
  auto unknown = ticker("x");
  unknown.plugin_name("test::Tickler");
  EXPECT_THAT(load(unknown).error_message(), HasSubstr("did you mean 'test::Ticker'?"));
  EXPECT_THAT(load(ticker("first")).error_message(),
              HasSubstr("there is a component 'first' already"));
  auto bad_parameter = ticker("x");
  bad_parameter.parameters({parameter("fail_at", std::string("soon"))});
  EXPECT_THAT(load(bad_parameter).error_message(), HasSubstr("expected integer, got string"));
  auto bad_extra = ticker("x");
  bad_extra.extra_arguments({parameter("on_eror", std::string("stop"))});
  EXPECT_THAT(load(bad_extra).error_message(), HasSubstr("did you mean 'on_error'?"));
  auto bad_remap = ticker("x");
  bad_remap.remap_rules({"tick:=/x", "nonsense"});
  EXPECT_THAT(load(bad_remap).error_message(), HasSubstr("expected port:=/topic"));
  auto throwing = ticker("x");
  throwing.plugin_name("test::ThrowingConstructor");
  EXPECT_THAT(load(throwing).error_message(), HasSubstr("the model file is missing"));
  EXPECT_EQ(container_->components().size(), 1U);
}

TEST_F(ContainerServicesTest, ParametersAreListedReadAndSet) {
  start(
      "container: {name: rig}\ncomponents:\n"
      "  - {plugin: test::Ticker, name: ticker, parameters: {hang_s: 0.001}}\n");
  const auto names =
      call<ListParameters_Request, ListParameters_Response>("/ticker/list_parameters", {});
  EXPECT_THAT(names.result().names(),
              ElementsAre("fail_at", "fail_in_start", "fail_now", "fault", "hang_s"));
  EXPECT_EQ(get("/ticker", "hang_s"), config::Value(0.001));
  EXPECT_EQ(get("/ticker", "no_such"), std::nullopt);

  const auto results = set("/ticker",
                           {parameter("hang_s", 0.002),
                            parameter("fault", std::string("worse")),
                            parameter("fail_att", std::int64_t{1}),
                            parameter("hang_s", std::string("x"))})
                           .results();
  ASSERT_EQ(results.size(), 4U);
  EXPECT_TRUE(results[0].successful());
  EXPECT_THAT(results[1].reason(), HasSubstr("must be one of std, int"));
  EXPECT_THAT(results[2].reason(), HasSubstr("did you mean 'fail_at'?"));
  EXPECT_THAT(results[3].reason(), HasSubstr("expected double, got string"));
  EXPECT_EQ(get("/ticker", "hang_s"), config::Value(0.002));
  EXPECT_EQ(get("/ticker", "fault"), config::Value(std::string("std")));
}

TEST_F(ContainerServicesTest, FixedParametersSaySo) {
  start("container: {name: rig}\ncomponents:\n  - {plugin: test::Fixed, name: fixed}\n");
  EXPECT_EQ(get("/fixed", "gains"), config::Value(std::vector<double>{1.0, 2.5}));
  const auto results = set("/fixed", {parameter("ransac.iterations", std::int64_t{5})}).results();
  ASSERT_EQ(results.size(), 1U);
  EXPECT_FALSE(results[0].successful());
  EXPECT_THAT(results[0].reason(), HasSubstr("fixed after start"));

  ListParameters_Request request;
  request.prefixes({"ransac"});
  const auto below =
      call<ListParameters_Request, ListParameters_Response>("/fixed/list_parameters", request);
  EXPECT_THAT(below.result().names(), ElementsAre("ransac.iterations"));
  EXPECT_THAT(below.result().prefixes(), ElementsAre("ransac"));
}

TEST_F(ContainerServicesTest, ChangeThatWaitsForABusyComponentKeepsNobodyFromSaving) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "results";
  std::filesystem::remove(file);
  start(
      "container: {name: rig}\ncomponents:\n"
      "  - {plugin: test::Ticker, name: busy, watchdog_s: 0.2, parameters: {hang_s: 8.0}}\n"
      "  - {plugin: test::Saver, name: results, parameters: {output_dir: " +
      ::testing::TempDir() + "}}\n");
  ASSERT_TRUE(test::wait_until([&] { return component("busy").overdue; }));
  EXPECT_EQ(get("/busy", "hang_s"), config::Value(8.0)) << "from here on services are found fast";
  const auto change = std::async(std::launch::async, [this] {
    SetParameters_Request request;
    request.parameters({parameter("hang_s", 0.0)});
    SetParameters_Response response;
    (void)dds::call(
        participant_, "/busy/set_parameters", request, response, std::chrono::seconds(7));
  });
  // While it waits, no other request is answered.
  ASSERT_TRUE(test::wait_until([this] {
    GetParameters_Response response;
    return !dds::call(participant_,
                      "/busy/get_parameters",
                      GetParameters_Request(),
                      response,
                      std::chrono::milliseconds(800));
  }));
  EXPECT_THAT(container_->stop(std::chrono::seconds(20)), IsEmpty());
  EXPECT_TRUE(std::filesystem::exists(file));
}

TEST_F(ContainerServicesTest, ParametersSetAtRunTimeOutliveARestart) {
  start(
      "container: {name: rig}\ncomponents:\n"
      "  - {plugin: test::Ticker, name: ticker, on_error: restart}\n");
  EXPECT_TRUE(set("/ticker", {parameter("hang_s", 0.003)}).results().at(0).successful());
  EXPECT_TRUE(set("/ticker", {parameter("fail_now", true)}).results().at(0).successful());
  ASSERT_TRUE(test::wait_until([&] { return component("ticker").restarts >= 2; }))
      << "fail_now is still set after the first restart";
  EXPECT_EQ(get("/ticker", "hang_s"), config::Value(0.003));
}

}  // namespace
}  // namespace camvox::bringup
