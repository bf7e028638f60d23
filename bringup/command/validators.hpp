#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace camvox::command {

/// A number above 0. CLI::PositiveNumber names its upper end as well, in 309 digits.
inline CLI::Validator above_zero() {
  return {[](std::string& text) {
            double value = 0.0;
            const bool good = CLI::detail::lexical_cast(text, value) && value > 0.0;
            return good ? std::string() : "'" + text + "' is not a number above 0";
          },
          "ABOVE 0"};
}

}  // namespace camvox::command
