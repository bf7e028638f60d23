#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "camvox/bringup/container.hpp"
#include "camvox/dds/executor.hpp"
#include "camvox/dds/service.hpp"

namespace camvox::bringup {

/// The services of a ROS 2 component container, and the parameter services of its components.
/// They run on the container's control thread.
class ContainerServices {
 public:
  using SetParameters =
      std::function<std::vector<Problem>(const std::string& component, const ParameterMap&)>;
  using GetParameters = std::function<ParameterMap(const std::string& component)>;

  ContainerServices(Container& container,
                    const std::string& container_name,
                    std::shared_ptr<dds::Participant> participant,
                    std::shared_ptr<dds::Executor> executor,
                    SetParameters set_parameters,
                    GetParameters get_parameters);
  ~ContainerServices();

  void add_component(const std::string& name);
  void remove_component(const std::string& name);
  /// False: a request is still being worked on.
  bool end(std::chrono::milliseconds timeout);

 private:
  struct Group {
    std::shared_ptr<dds::Tenant> tenant;
    std::vector<std::unique_ptr<dds::ServiceServer>> servers;
  };

  void serve_container(Container& container, const std::string& name);
  void serve_get(Group& group, const std::string& component);
  void serve_set(Group& group, const std::string& component);
  void serve_list(Group& group, const std::string& component);
  [[nodiscard]] Group make_group(const std::string& name) const;
  template <typename Request, typename Response>
  void serve(Group& group,
             const std::string& name,
             std::function<void(const Request&, Response&)> handler);

  std::shared_ptr<dds::Participant> participant_;
  std::shared_ptr<dds::Executor> executor_;
  std::shared_ptr<Logger> log_;
  SetParameters set_parameters_;
  GetParameters get_parameters_;
  Group container_group_;
  std::map<std::string, Group> groups_;
};

}  // namespace camvox::bringup
