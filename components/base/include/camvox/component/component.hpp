#pragma once

#include <class_loader/register_macro.hpp>
#include <memory>

#include "camvox/component/context.hpp"

namespace camvox {

/// A stage of the pipeline, loaded by name into a container. A class derived from it has a
/// constructor `explicit MyComponent(camvox::Context&)` that reads its config, builds its core and
/// wires its topics, and nothing else: no files, no threads, no sensor. (The container builds every
/// component once on a recording context to check the whole config before anything starts.)
/// All callbacks of one component run on one thread, one at a time.
class Component {
 public:
  Component() = default;
  Component(const Component&) = delete;
  Component& operator=(const Component&) = delete;
  virtual ~Component() = default;

  /// Called once on the component's thread when all components are wired; may open files.
  virtual void start() {}

  /// Called once when the component ends, after its last callback: the place to save results and to
  /// join own threads. May publish; posted work does not run any more. What it throws is logged.
  virtual void stop() {}
};

/// Makes components of one class; what a plugin library exports.
class ComponentFactory {
 public:
  virtual ~ComponentFactory() = default;
  virtual std::unique_ptr<Component> create(Context& context) = 0;
};

template <typename ComponentClass>
class ComponentFactoryTemplate final : public ComponentFactory {
 public:
  std::unique_ptr<Component> create(Context& context) override {
    return std::make_unique<ComponentClass>(context);
  }
};

}  // namespace camvox

/// Exports a component class from a plugin library; once, at the end of its source file.
#define CAMVOX_REGISTER_COMPONENT(ComponentClass)                               \
  CLASS_LOADER_REGISTER_CLASS(camvox::ComponentFactoryTemplate<ComponentClass>, \
                              camvox::ComponentFactory)
