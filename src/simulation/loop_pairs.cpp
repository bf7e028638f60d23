#include "camvox/simulation/loop_pairs.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace camvox::simulation {

std::vector<LoopPair> loop_pairs(const Trajectory& trajectory,
                                 double rate_hz,
                                 const LoopPairRule& rule) {
  struct Place {
    Eigen::Vector3d position;
    Eigen::Vector3d heading;
    double travelled_m;
  };
  std::vector<Place> places;
  std::vector<LoopPair> pairs;
  const auto frames = static_cast<std::size_t>(trajectory.duration_s() * rate_hz) + 1;
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const geometry::SE3 T = trajectory.pose(static_cast<double>(frame) / rate_hz);
    const Eigen::Vector3d heading = T.rotation() * Eigen::Vector3d::UnitX();
    double travelled = 0.0;
    if (frame > 0)
      travelled = places.back().travelled_m + (T.translation() - places.back().position).norm();
    double nearest = rule.max_distance_m;
    std::size_t match = frame;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (travelled - places[i].travelled_m < rule.min_travel_m) break;
      const double distance = (T.translation() - places[i].position).norm();
      if (distance < nearest) {
        nearest = distance;
        match = i;
      }
    }
    if (match != frame) {
      const double cosine = std::clamp(heading.dot(places[match].heading), -1.0, 1.0);
      pairs.push_back({static_cast<std::int64_t>(match),
                       static_cast<std::int64_t>(frame),
                       nearest,
                       std::acos(cosine)});
    }
    places.push_back({T.translation(), heading, travelled});
  }
  return pairs;
}

}  // namespace camvox::simulation
