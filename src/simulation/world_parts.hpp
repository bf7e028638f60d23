#pragma once

#include "camvox/simulation/random.hpp"
#include "camvox/simulation/world.hpp"

namespace camvox::simulation {

void build_campus(SequentialRandom& random, World& world);
void build_street(SequentialRandom& random, World& world);
void build_plaza(SequentialRandom& random, World& world);
void build_corridor(SequentialRandom& random, World& world);

/// The rectangles that people walk around and cars drive around, one after the other.
using Circuits = std::vector<std::vector<Eigen::Vector2f>>;
[[nodiscard]] std::vector<Eigen::Vector2f> rectangle(float x0, float y0, float x1, float y1);
void add_traffic(const WorldConfig& options,
                 const Circuits& walks,
                 const Circuits& drives,
                 World& world);

/// Circuits of each kind of world.
[[nodiscard]] Circuits walks_of(const World& world);
[[nodiscard]] Circuits drives_of(const World& world);

}  // namespace camvox::simulation
