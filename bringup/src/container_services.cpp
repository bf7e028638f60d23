#include "container_services.hpp"

#include <algorithm>

#include "camvox/bringup/parameter_messages.hpp"
#include "camvox/interfaces/composition_interfaces.hpp"
#include "load_request.hpp"

namespace camvox::bringup {
namespace {

using namespace composition_interfaces::srv;
using namespace rcl_interfaces::srv;

constexpr std::chrono::milliseconds kRemoveTimeout{1000};

void load_node(Container& container, const LoadNode_Request& request, LoadNode_Response& response) {
  try {
    const auto info = container.load(to_component_config(request));
    response.success(true);
    response.full_node_name("/" + info.name);
    response.unique_id(info.id);
  } catch (...) {
    response.success(false);
    response.error_message(describe(std::current_exception()));
  }
}

void unload_node(Container& container,
                 const UnloadNode_Request& request,
                 UnloadNode_Response& response) {
  try {
    container.unload(request.unique_id());
    response.success(true);
  } catch (...) {
    response.success(false);
    response.error_message(describe(std::current_exception()));
  }
}

/// True if the name is asked for: below one of the prefixes, or no prefix given. `depth` counts
/// the dots below the prefix; 0 is any.
bool is_listed(const std::string& name, const ListParameters_Request& request) {
  const auto within_depth = [&](std::size_t start) {
    const auto dots =
        std::count(name.begin() + static_cast<std::ptrdiff_t>(start), name.end(), '.');
    return request.depth() == 0 || static_cast<std::uint64_t>(dots) < request.depth();
  };
  if (request.prefixes().empty()) return within_depth(0);
  return std::any_of(request.prefixes().begin(), request.prefixes().end(), [&](const auto& prefix) {
    if (name == prefix) return true;
    return name.starts_with(prefix + ".") && within_depth(prefix.size() + 1);
  });
}

void list_parameters(const ParameterMap& parameters,
                     const ListParameters_Request& request,
                     ListParameters_Response& response) {
  auto& prefixes = response.result().prefixes();
  for (const auto& [name, parameter] : parameters) {
    if (!is_listed(name, request)) continue;
    response.result().names().push_back(name);
    const auto dot = name.rfind('.');
    if (dot == std::string::npos) continue;
    const auto prefix = name.substr(0, dot);
    if (std::find(prefixes.begin(), prefixes.end(), prefix) == prefixes.end()) {
      prefixes.push_back(prefix);
    }
  }
}

}  // namespace

ContainerServices::ContainerServices(Container& container,
                                     const std::string& container_name,
                                     std::shared_ptr<dds::Participant> participant,
                                     std::shared_ptr<dds::Executor> executor,
                                     SetParameters set_parameters,
                                     GetParameters get_parameters)
    : participant_(std::move(participant)),
      executor_(std::move(executor)),
      set_parameters_(std::move(set_parameters)),
      get_parameters_(std::move(get_parameters)),
      container_group_(make_group(container_name)) {
  serve_container(container, container_name);
}

ContainerServices::~ContainerServices() { end(kRemoveTimeout); }

ContainerServices::Group ContainerServices::make_group(const std::string& name) const {
  // Handlers report errors in their responses; nothing leaves them.
  return {std::make_shared<dds::Tenant>(name, [](const std::exception_ptr&) {}), {}};
}

template <typename Request, typename Response>
void ContainerServices::serve(Group& group,
                              const std::string& name,
                              std::function<void(const Request&, Response&)> handler) {
  group.servers.push_back(dds::serve<Request, Response>(
      participant_, *executor_, group.tenant, name, std::move(handler)));
}

void ContainerServices::serve_container(Container& container, const std::string& name) {
  const std::string prefix = "/" + name + "/_container/";
  serve<LoadNode_Request, LoadNode_Response>(
      container_group_, prefix + "load_node", [&container](const auto& request, auto& response) {
        load_node(container, request, response);
      });
  serve<UnloadNode_Request, UnloadNode_Response>(
      container_group_, prefix + "unload_node", [&container](const auto& request, auto& response) {
        unload_node(container, request, response);
      });
  serve<ListNodes_Request, ListNodes_Response>(
      container_group_, prefix + "list_nodes", [&container](const auto&, auto& response) {
        for (const auto& info : container.components()) {
          response.full_node_names().push_back("/" + info.name);
          response.unique_ids().push_back(info.id);
        }
      });
}

void ContainerServices::add_component(const std::string& name) {
  Group group = make_group(name);
  serve_list(group, name);
  serve_get(group, name);
  serve_set(group, name);
  groups_.insert_or_assign(name, std::move(group));
}

void ContainerServices::serve_list(Group& group, const std::string& component) {
  serve<ListParameters_Request, ListParameters_Response>(
      group,
      "/" + component + "/list_parameters",
      [this, component](const auto& request, auto& response) {
        list_parameters(get_parameters_(component), request, response);
      });
}

void ContainerServices::serve_get(Group& group, const std::string& component) {
  serve<GetParameters_Request, GetParameters_Response>(
      group,
      "/" + component + "/get_parameters",
      [this, component](const auto& request, auto& response) {
        const auto parameters = get_parameters_(component);
        for (const auto& name : request.names()) {
          const auto found = parameters.find(name);
          response.values().push_back(found == parameters.end()
                                          ? rcl_interfaces::msg::ParameterValue()
                                          : to_message(found->second.value));
        }
      });
}

void ContainerServices::serve_set(Group& group, const std::string& component) {
  serve<SetParameters_Request, SetParameters_Response>(
      group,
      "/" + component + "/set_parameters",
      [this, component](const auto& request, auto& response) {
        for (const auto& parameter : request.parameters()) {
          auto& result = response.results().emplace_back();
          const auto value = from_message(parameter.value());
          if (!value) {
            result.reason("parameter '" + parameter.name() +
                          "' cannot be unset, nor be of this type");
            continue;
          }
          const auto problems = set_parameters_(component, {{parameter.name(), {*value, {"", 0}}}});
          result.successful(problems.empty());
          if (!problems.empty()) result.reason(config::ConfigError(problems).what());
        }
      });
}

void ContainerServices::remove_component(const std::string& name) {
  groups_.erase(name);  // which ends its servers
}

bool ContainerServices::end(std::chrono::milliseconds timeout) {
  bool ended = true;
  const auto end_group = [&](const Group& group) {
    for (const auto& server : group.servers) ended = server->end(timeout) && ended;
  };
  end_group(container_group_);
  for (const auto& [name, group] : groups_) end_group(group);
  return ended;
}

}  // namespace camvox::bringup
