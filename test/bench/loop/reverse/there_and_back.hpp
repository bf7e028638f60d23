#pragma once

#include <numbers>
#include <string>
#include <vector>

#include "camvox/simulation/route.hpp"
#include "camvox/simulation/simulator.hpp"

namespace camvox::bench {

/// A drive that sees its places again in the other direction, and in the same one.
struct ThereAndBack {
  simulation::SimulationOptions options;
  simulation::Trajectory trajectory;

  /// `world`: street, plaza, corridor, or one of the presets loop_400m and campus_1800m.
  static ThereAndBack make(const std::string& world) {
    if (world == "loop_400m" || world == "campus_1800m") {
      auto options = simulation::preset(world);
      auto blind = options;  // the motion alone, without a look at the world
      blind.images = blind.scans = false;
      options.motion = "given";
      return {options, simulation::Simulator(blind).trajectory()};
    }
    auto options = simulation::preset(world == "corridor" ? "corridor" : "demo");
    options.lidar = {};
    options.motion = "given";
    options.world.kind = world;
    if (world == "street") {
      options.world.cars = 4;
      options.world.people = 14;
    }
    simulation::Drivetrain robot;
    robot.max_speed_m_s = options.max_speed_m_s;
    robot.bump_height_m = options.bump_height_m;
    robot.ground_seed = static_cast<std::uint64_t>(options.world.seed);
    return {options, simulation::plan_route(route(world), robot)};
  }

 private:
  static simulation::Route route(const std::string& world) {
    using simulation::Drive;
    using simulation::Turn;
    constexpr double kPi = std::numbers::pi;
    if (world == "corridor") {
      return {{2.5, 0.0},
              0.0,
              {Drive{{{40.5, 0.0}}, 1.0},
               Turn{kPi},
               Drive{{{2.5, 0.0}}, 1.0},
               Turn{kPi},
               Drive{{{40.5, 0.0}}, 1.0}}};
    }
    if (world == "plaza") {
      const std::vector<Eigen::Vector2d> loop = {
          {14.5, -10.5}, {14.5, 8.5}, {-14.5, 8.5}, {-14.5, -10.5}};
      auto back = std::vector<Eigen::Vector2d>(loop.rbegin() + 1, loop.rend());
      back.push_back(loop.back());
      return {{-14.5, -10.5},
              0.0,
              {Drive{loop, 3.0},
               Turn{kPi},
               Drive{back, 3.0},
               Turn{kPi / 2},
               Drive{{loop.begin(), loop.begin() + 2}, 3.0}}};
    }
    // On the right-hand side of the road, so the ways back and forth are 2.4 m apart.
    return {{-90.0, -1.2},
            0.0,
            {Drive{{{30.0, -1.2}}, 1.0},
             Turn{kPi / 2},
             Drive{{{30.0, 1.2}}, 1.0},
             Turn{kPi / 2},
             Drive{{{-90.0, 1.2}}, 1.0},
             Turn{kPi / 2},
             Drive{{{-90.0, -1.2}}, 1.0},
             Turn{kPi / 2},
             Drive{{{30.0, -1.2}}, 1.0}}};
  }
};

}  // namespace camvox::bench
