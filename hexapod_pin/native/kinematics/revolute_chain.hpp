// Revolute joints in a row: where the foot at their end is, and how it moves.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "laws/vectors.hpp"

namespace hexapod {

template <int J>
struct ChainPose {
  Vec3 foot;                             // m
  Eigen::Matrix<double, 3, J> jacobian;  // d foot / d q, a column per joint, m/rad
};

template <int J>
struct RevoluteChain {
  std::array<Vec3, J> axis, origin;  // at joint angles of zero, base axes: unit vectors; m
  Vec3 foot;                         // its centre at joint angles of zero, base frame, m

  // From the foot inwards: a joint turns what is outside of it.
  ChainPose<J> pose(const Eigen::Matrix<double, J, 1>& q) const {
    ChainPose<J> out;
    Vec3 p = foot;
    for (int k = J - 1; k >= 0; --k) {
      const double c = std::cos(q[k]), s = std::sin(q[k]);
      p = origin[k] + turned(p - origin[k], axis[k], c, s);
      for (int j = k + 1; j < J; ++j) out.jacobian.col(j) = turned(out.jacobian.col(j), axis[k], c, s);
      out.jacobian.col(k) = axis[k].cross(p - origin[k]);
    }
    out.foot = p;
    return out;
  }

 private:
  static Vec3 turned(const Vec3& v, const Vec3& axis, double c, double s) {
    return c * v + s * axis.cross(v) + ((1.0 - c) * axis.dot(v)) * axis;
  }
};

}  // namespace hexapod
