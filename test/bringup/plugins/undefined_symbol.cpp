// Calls a function that no library has: loading must fail with its name.
#include "camvox/component/component.hpp"

namespace test {

void function_of_a_missing_library();

class Undefined : public camvox::Component {
 public:
  explicit Undefined(camvox::Context&) { function_of_a_missing_library(); }
};

}  // namespace test

CAMVOX_REGISTER_COMPONENT(test::Undefined)
