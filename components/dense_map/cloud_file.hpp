#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "camvox/dense/dense_map.hpp"
#include "camvox/dense/top_view.hpp"

namespace camvox::dense_map {

/// Write whole or not at all. They return what went wrong, or "".
[[nodiscard]] std::string save_pcd(const std::filesystem::path& file,
                                   const std::vector<dense::ColouredPoint>& points);
[[nodiscard]] std::string save_ply(const std::filesystem::path& file,
                                   const std::vector<dense::ColouredPoint>& points);
[[nodiscard]] std::string save_png(const std::filesystem::path& file,
                                   const dense::Picture& picture);

}  // namespace camvox::dense_map
