#include "camvox/simulation/options.hpp"

#include <algorithm>
#include <utility>

namespace camvox::simulation {
namespace {

using config::Problem;

/// The corridor and the plaza have no streets to drive on: each motion needs its world.
bool fits(const std::string& motion, const std::string& world) {
  if (motion == "loop_400m" || motion == "campus_1800m") return world == "campus";
  if (motion == "corridor") return world == "corridor" || world == "street";
  if (motion == "plaza_loop") return world == "plaza";
  return true;
}

void append(std::vector<Problem> more, const std::string& prefix, std::vector<Problem>& problems) {
  for (Problem& problem : more) {
    problem.key = prefix + problem.key;
    const auto same = [&](const Problem& known) {
      return known.key == problem.key && known.message == problem.message;
    };
    if (std::find_if(problems.begin(), problems.end(), same) == problems.end()) {
      problems.push_back(std::move(problem));
    }
  }
}

}  // namespace

std::vector<Problem> check(const SimulationOptions& options, const std::string& origin) {
  std::vector<Problem> problems = config::check(options, origin);
  append(sensors::check(options.intrinsics, origin), "intrinsics.", problems);
  append(sensors::check(options.rig, origin), "rig.", problems);
  for (const auto& [key, values] :
       {std::pair{"extrinsics_error_deg", &options.extrinsics_error_deg},
        std::pair{"extrinsics_error_m", &options.extrinsics_error_m}}) {
    if (values->size() != 3) {
      problems.push_back(
          {{origin, 0}, key, "expected 3 numbers, got " + std::to_string(values->size())});
    }
  }
  if (!fits(options.motion, options.world.kind)) {
    problems.push_back(
        {{origin, 0}, "motion", options.motion + " does not fit world.kind " + options.world.kind});
  }
  return problems;
}

std::vector<std::string> preset_names() {
  return {"demo", "loop_400m", "campus_1800m", "standstill", "corridor", "rotation", "dropouts"};
}

SimulationOptions preset(const std::string& name) {
  SimulationOptions options;
  if (name == "loop_400m") return options;
  if (name == "campus_1800m") {
    options.motion = name;
    return options;
  }
  if (name == "dropouts") {
    options.faults = {0.05, 0.05, 0.01, 0.3, 0.02, 0.15, 0.001};
    return options;
  }
  options.world.cars = 0;
  options.world.people = 8;
  options.world.kind = "plaza";
  if (name == "demo") {
    // At most 150 MB: a Horizon's points alone would be 200 MB, so this lidar fires 83 000 a
    // second.
    options.motion = "plaza_loop";
    options.lidar.point_interval_ns = 12'000;
    options.camera.jpeg_quality = 60;
  } else if (name == "standstill") {
    options.motion = name;
    options.world.people = 4;
  } else if (name == "rotation") {
    options.motion = name;
  } else if (name == "corridor") {
    options.motion = name;
    options.world.kind = "corridor";
    options.world.people = 1;
    options.max_speed_m_s = 1.2;
    options.bump_height_m = 0.001;
    options.camera.gain = 0.7;
  } else {
    const std::string nearest = config::nearest_name(name, preset_names());
    throw config::ConfigError(
        {{{"simulation", 0},
          name,
          "unknown preset" + (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)")}});
  }
  return options;
}

}  // namespace camvox::simulation
