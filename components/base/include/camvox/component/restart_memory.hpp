#pragma once

#include <any>

#include "camvox/component/context.hpp"

namespace camvox {

/// Implemented by contexts whose component is made anew after an error (on_error: restart).
class RestartMemory {
 public:
  virtual ~RestartMemory() = default;
  [[nodiscard]] virtual std::any& restart_memory() = 0;
};

/// What a component leaves to the one that takes its place after an error; empty at first. For what
/// was found while running and no config knows. Of the component's thread; null where nobody keeps
/// it.
[[nodiscard]] inline std::any* restart_memory(Context& context) {
  auto* keeper = dynamic_cast<RestartMemory*>(&context);
  return keeper == nullptr ? nullptr : &keeper->restart_memory();
}

}  // namespace camvox
