#include "camvox/sensors/camera_intrinsics.hpp"

#include <cmath>

namespace camvox::sensors {

std::vector<config::Problem> check(const CameraIntrinsics& intrinsics, const std::string& origin) {
  std::vector<config::Problem> problems = config::check(intrinsics, origin);
  const std::string& model = intrinsics.distortion_model;
  const std::size_t most = model == "plumb_bob" ? 5 : model == "rational_polynomial" ? 8 : 4;
  if (intrinsics.distortion.size() > most) {
    problems.push_back({{origin, 0},
                        "distortion",
                        std::to_string(intrinsics.distortion.size()) + " coefficients, but " +
                            model + " has at most " + std::to_string(most)});
  }
  return problems;
}

}  // namespace camvox::sensors
