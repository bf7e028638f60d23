#pragma once

#include <Eigen/Core>
#include <numbers>
#include <random>
#include <vector>

namespace camvox::test {

/// Surfaces along a street in x, z up, a camera 1.5 m above the ground: for tests of whatever works
/// on points on surfaces. No two stretches of it are alike.
class SurfaceScene {
 public:
  /// From -40 m to `length_m` + 40 m.
  static SurfaceScene street(double length_m, unsigned seed = 1) {
    SurfaceScene scene;
    std::mt19937 random(seed);
    const auto within = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (double x = -40.0; x < length_m + 40.0; x += 10.0) {
      for (const double side : {-1.0, 1.0}) {
        scene.pieces_.push_back({Kind::kGround, {x + 5.0, side * 5.0, -1.5}, {10.0, 10.0, 0.0}});
        if (within(0.0, 1.0) < 0.7) {
          const double y = side * within(7.0, 10.0);
          scene.pieces_.push_back({Kind::kFacade, {x + 4.0, y, 1.0}, {within(5.0, 9.0), 0.0, 5.0}});
        }
        for (int i = 0; i < 2; ++i) {
          const Eigen::Vector3d at(x + within(0.0, 10.0), side * within(3.0, 6.0), 0.5);
          scene.pieces_.push_back({Kind::kPole, at, {0.3, 0.3, 4.0}});
        }
        const Eigen::Vector3d bush(x + within(0.0, 10.0), side * within(3.5, 6.0), -0.5);
        scene.pieces_.push_back({Kind::kBush, bush, {1.5, 1.5, 2.0}});
      }
    }
    return scene;
  }

  /// Two smooth walls, ground and nothing else.
  static SurfaceScene corridor(double length_m) {
    SurfaceScene scene;
    const double x = 0.5 * length_m;
    scene.pieces_ = {{Kind::kGround, {x, 0.0, -1.5}, {length_m + 80.0, 4.0, 0.0}},
                     {Kind::kFacade, {x, -2.0, 0.5}, {length_m + 80.0, 0.0, 4.0}},
                     {Kind::kFacade, {x, 2.0, 0.5}, {length_m + 80.0, 0.0, 4.0}}};
    return scene;
  }

  /// Points on the surfaces with `sigma_m` of noise, other ones for every seed.
  [[nodiscard]] std::vector<Eigen::Vector3d> sample(unsigned seed, double sigma_m = 0.02) const {
    constexpr double kPerM2 = 12.0;
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0.0, sigma_m);
    std::uniform_real_distribution<double> unit(-0.5, 0.5);
    std::vector<Eigen::Vector3d> points;
    for (const auto& piece : pieces_) {
      const auto count = static_cast<int>(kPerM2 * area_m2(piece));
      for (int i = 0; i < count; ++i) {
        Eigen::Vector3d p = piece.centre + piece.extent.cwiseProduct(Eigen::Vector3d(
                                               unit(random), unit(random), unit(random)));
        if (piece.kind == Kind::kPole) {
          const double angle = 2.0 * std::numbers::pi * unit(random);
          p.head<2>() = piece.centre.head<2>() +
                        0.5 * piece.extent.x() * Eigen::Vector2d(std::cos(angle), std::sin(angle));
        }
        points.push_back(p + Eigen::Vector3d(noise(random), noise(random), noise(random)));
      }
    }
    return points;
  }

 private:
  enum class Kind { kGround, kFacade, kPole, kBush };
  struct Piece {
    Kind kind;
    Eigen::Vector3d centre;
    Eigen::Vector3d extent;
  };
  static double area_m2(const Piece& piece) {
    switch (piece.kind) {
      case Kind::kGround:
        return 0.5 * piece.extent.x() * piece.extent.y();  // poor in features
      case Kind::kFacade:
        return piece.extent.x() * piece.extent.z();
      case Kind::kPole:
        return 3.0 * piece.extent.x() * piece.extent.z();
      case Kind::kBush:
        return 4.0 * piece.extent.x() * piece.extent.z();
    }
    return 0.0;
  }
  std::vector<Piece> pieces_;
};

}  // namespace camvox::test
