// Closed-form inverse kinematics of a yaw-pitch-pitch leg on one branch: see robot/leg_geometry.py, whose
// formulas these are, for one target at a time.
#pragma once

#include <algorithm>
#include <cmath>

#include "laws/vectors.hpp"

namespace hexapod {

struct LegInverse {
  Mat3 hip_axes;                // hip axes as columns in base axes
  Vec3 hip;                     // hip origin in the base frame, m
  Vec3 lengths, sign, offset;   // m, -, rad
  double fold, knee;            // branch, +1 or -1
  double tolerance;             // rounding of the reach, m
  Vec3 lower, upper;            // joint limits with their tolerance, rad

  static constexpr double kYawAxis = 1e-9;  // m; nearer to the yaw axis its angle is undefined

  // Joint angles [rad] that put the foot at `target` (base frame, m), by whole turns nearest to what `q`
  // holds. False: out of reach, on the yaw axis, or beyond a limit; `q` is not to be used then.
  bool solve(const Vec3& target, Vec3& q) const {
    const Vec3 p = hip_axes.transpose() * (target - hip);
    const double radius = std::hypot(p.x(), p.y());
    const double near = std::abs(lengths[1] - lengths[2]), far = lengths[1] + lengths[2];
    const double u = fold * radius - lengths[0], rho = std::hypot(u, p.z());
    const double outside = std::max(rho - far, near - rho);
    if (!(radius >= kYawAxis && outside <= tolerance)) return false;
    const double stretch = std::max((far - rho) * (far + rho), 0.0);
    const double bend = std::max((rho - near) * (rho + near), 0.0);
    const double q3 = knee * 2.0 * std::atan2(std::sqrt(stretch), std::sqrt(bend));
    const double q2 = std::atan2(-p.z(), u) - std::atan2(lengths[2] * std::sin(q3),
                                                         lengths[1] + lengths[2] * std::cos(q3));
    const Vec3 angles(std::atan2(fold * p.y(), fold * p.x()), q2, q3);
    const Vec3 found = sign.cwiseProduct(angles - offset);
    constexpr double kTurn = 6.283185307179586;
    for (int k = 0; k < 3; ++k) {
      q[k] = found[k] + kTurn * std::nearbyint((q[k] - found[k]) / kTurn);
      if (!(q[k] >= lower[k] && q[k] <= upper[k])) return false;
    }
    return true;
  }
};

}  // namespace hexapod
