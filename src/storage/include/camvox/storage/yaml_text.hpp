#pragma once

#include <string>
#include <string_view>

namespace camvox::storage {

/// The text as a YAML scalar that reads back as this very string: plain where that is safe, in
/// single quotes where it would be taken for something else ('true', '12', ''), in double quotes
/// with escapes where it holds control characters or is not UTF-8.
[[nodiscard]] std::string yaml_string(std::string_view text);

/// Always in double quotes.
[[nodiscard]] std::string yaml_quoted(std::string_view text);

}  // namespace camvox::storage
