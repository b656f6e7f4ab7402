// The ground under a sphere: its gap and normal.
#pragma once

#include <Eigen/Core>

namespace hexapod {

using Vec3 = Eigen::Vector3d;

struct GroundPoint {
  double gap;   // distance of the sphere's nearest point to the ground, m; negative = penetration
  Vec3 normal;  // unit, out of the ground, world axes
};

struct Flat {
  double height = 0.0;  // m

  GroundPoint under(const Vec3& center, double radius) const {
    return {center.z() - radius - height, Vec3::UnitZ()};
  }
};

}  // namespace hexapod
