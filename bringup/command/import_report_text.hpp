#pragma once

#include <string>

#include "camvox/import/import_report.hpp"

namespace camvox::command {

/// What an importer found and made, as aligned tables for people.
[[nodiscard]] std::string report_text(const import::ImportReport& report);

}  // namespace camvox::command
