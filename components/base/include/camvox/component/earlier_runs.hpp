#pragma once

#include <cstdint>

#include "camvox/component/context.hpp"

namespace camvox {

/// Implemented by contexts that know how often their component was made before.
class RunCounter {
 public:
  virtual ~RunCounter() = default;
  [[nodiscard]] virtual std::uint64_t earlier_runs() const = 0;
};

/// How many components of this name the container has had before: 0 at first, then one more with
/// each restart or load. For numbers that others compare and that must therefore not begin anew.
/// 0 where nobody counts.
[[nodiscard]] inline std::uint64_t earlier_runs(const Context& context) {
  const auto* counter = dynamic_cast<const RunCounter*>(&context);
  return counter == nullptr ? 0 : counter->earlier_runs();
}

}  // namespace camvox
