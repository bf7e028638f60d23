#include "motions.hpp"

#include <cmath>
#include <initializer_list>
#include <numbers>

namespace camvox::simulation {
namespace {

using Eigen::Vector2d;
constexpr double kPi = std::numbers::pi;
constexpr double kLane_m = 1.2;  ///< The robot keeps this far to the right of the road's middle.

/// Way points along streets from crossing to crossing, on the right-hand side.
std::vector<Vector2d> along_streets(std::initializer_list<std::pair<int, int>> crossings,
                                    const Vector2d& block) {
  std::vector<Vector2d> nodes;
  for (const auto& [i, j] : crossings) nodes.push_back(block.cwiseProduct(Vector2d(i, j)));
  const auto right_of = [](const Vector2d& direction) {
    return Vector2d(direction.y(), -direction.x()).normalized();
  };
  std::vector<Vector2d> waypoints;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Vector2d in = i > 0 ? Vector2d(nodes[i] - nodes[i - 1]) : Vector2d(nodes[1] - nodes[0]);
    const Vector2d out = i + 1 < nodes.size() ? Vector2d(nodes[i + 1] - nodes[i]) : in;
    const Vector2d a = right_of(in);
    const Vector2d b = right_of(out);
    // Corner of the two lanes; straight on, the lanes are one.
    waypoints.emplace_back(nodes[i] + kLane_m * (std::abs(a.dot(b)) > 0.5 ? a : Vector2d(a + b)));
  }
  return waypoints;
}

Route loop_400m(const Vector2d& block) {
  const auto loop = along_streets({{1, 1}, {2, 1}, {2, 2}, {1, 2}, {1, 1}, {2, 1}}, block);
  Route route{loop.front(), 0.0, {}};
  route.legs.push_back(Pause{3.0});
  route.legs.push_back(Drive{{loop.begin() + 1, loop.end() - 1}, 2.5});
  route.legs.push_back(Pause{2.0});
  route.legs.push_back(Turn{kPi / 2});
  route.legs.push_back(Drive{{loop.back()}, 2.5});
  route.legs.push_back(Turn{kPi});
  auto home = along_streets({{2, 1}, {1, 1}}, block);
  home.emplace_back(home.back() - Vector2d(0.5 * block.x(), 0.0));
  route.legs.push_back(Drive{home, 2.5});
  return route;
}

Route campus_1800m(const Vector2d& block) {
  Route route;
  const auto outer = along_streets({{0, 0},
                                    {1, 0},
                                    {2, 0},
                                    {3, 0},
                                    {3, 1},
                                    {3, 2},
                                    {3, 3},
                                    {2, 3},
                                    {1, 3},
                                    {0, 3},
                                    {0, 2},
                                    {0, 1},
                                    {0, 0}},
                                   block);
  const auto back = along_streets(
      {{0, 0}, {0, 1}, {0, 2}, {1, 2}, {2, 2}, {2, 1}, {2, 0}, {1, 0}, {0, 0}}, block);
  const auto cross = along_streets({{0, 0},
                                    {1, 0},
                                    {1, 1},
                                    {1, 2},
                                    {1, 3},
                                    {2, 3},
                                    {3, 3},
                                    {3, 2},
                                    {3, 1},
                                    {2, 1},
                                    {1, 1},
                                    {1, 0},
                                    {0, 0}},
                                   block);
  route.start_m = outer.front();
  route.legs.push_back(Pause{3.0});
  route.legs.push_back(Drive{{outer.begin() + 1, outer.begin() + 7}, 2.5});
  route.legs.push_back(Pause{4.0});
  route.legs.push_back(Turn{kPi / 2});
  route.legs.push_back(Drive{{outer.begin() + 7, outer.end()}, 2.5});
  route.legs.push_back(Pause{2.0});
  route.legs.push_back(Turn{kPi});
  route.legs.push_back(Drive{back, 2.5});
  route.legs.push_back(Turn{kPi});
  route.legs.push_back(Drive{cross, 2.5});
  return route;
}

Route plaza_loop() {
  Route route{{-14.5, -10.5}, 0.0, {}};
  const std::vector<Vector2d> loop = {
      {14.5, -10.5}, {14.5, 8.5}, {-14.5, 8.5}, {-14.5, -10.5}, {-7.0, -10.5}};
  route.legs.push_back(Pause{2.0});
  route.legs.push_back(Drive{{loop.begin(), loop.begin() + 2}, 3.0});
  route.legs.push_back(Pause{1.0});
  route.legs.push_back(Turn{kPi / 2});
  route.legs.push_back(Drive{{loop.begin() + 2, loop.end()}, 3.0});
  route.legs.push_back(Pause{1.0});
  return route;
}

Route corridor(double length_m) {
  Route route{{2.5, 0.0}, 0.0, {}};
  route.legs = {Pause{2.0},
                Drive{{{2.5 + length_m, 0.0}}, 1.0},
                Pause{1.0},
                Turn{kPi},
                Drive{{{2.5, 0.0}}, 1.0},
                Pause{1.0}};
  return route;
}

/// In the open, out of the way of what moves.
Vector2d standing_place(const World& world) {
  if (world.kind == "plaza") return {-22.0, -9.0};
  if (world.kind == "corridor") return {6.0, 0.0};
  return {10.0, -1.2};
}

}  // namespace

Trajectory make_motion(const SimulationOptions& options, const World& world) {
  const Vector2d block = world.block_m.cast<double>();
  Route route;
  if (options.motion == "loop_400m") route = loop_400m(block);
  if (options.motion == "campus_1800m") route = campus_1800m(block);
  if (options.motion == "plaza_loop") route = plaza_loop();
  if (options.motion == "corridor") route = corridor(world.kind == "corridor" ? 38.0 : 80.0);
  if (options.motion == "standstill") route = {standing_place(world), 0.35, {Pause{10.0}}};
  if (options.motion == "rotation") {
    route = {standing_place(world),
             0.0,
             {Pause{1.0}, Turn{2 * kPi}, Pause{1.0}, Turn{-kPi}, Turn{kPi}, Pause{1.0}}};
  }
  Drivetrain robot;
  robot.max_speed_m_s = options.max_speed_m_s;
  robot.bump_height_m = options.bump_height_m;
  robot.ground_seed = world.seed;
  return plan_route(route, robot);
}

}  // namespace camvox::simulation
