// One place where a sphere meets the ground.
#pragma once

#include <array>

#include <Eigen/Core>

namespace hexapod {

using Vec3 = Eigen::Vector3d;

constexpr int kMostContacts = 2;  // of one sphere
constexpr double kFarAway = 1e9;  // gap where there is no contact, m

struct GroundPoint {
  double gap = kFarAway;         // distance of the sphere to the ground, m; negative = penetration
  Vec3 normal = Vec3::UnitZ();   // unit, out of the ground, world axes
};

using GroundPoints = std::array<GroundPoint, kMostContacts>;

}  // namespace hexapod
