// Joint stops: a spring with dissipation beyond each end of a joint's range, never pulling.
//   torque = -K d max(0, 1 + 1.5 a d'), d how far the joint is beyond its limit
#pragma once

#include <cmath>

#include "laws/vectors.hpp"

namespace hexapod {

struct StopTorque {
  double torque = 0.0;     // N m, on the joint
  double stiffness = 0.0;  // -d torque/d angle, N m/rad
  double damping = 0.0;    // -d torque/d rate, N m s/rad

  // To first order, after changes of angle [rad] and rate [rad/s].
  double after(double angle, double rate) const {
    return torque - stiffness * angle - damping * rate;
  }
};

struct JointStops {
  VectorXd lower, upper;     // rad, may be infinite
  double stiffness = 0.0;    // K, N m/rad; 0: no stops
  double dissipation = 0.0;  // a, s/rad

  bool present() const { return stiffness > 0.0; }

  double beyond(int joint, double angle) const {  // > 0 above the range, < 0 below it, rad
    if (angle > upper[joint]) return angle - upper[joint];
    if (angle < lower[joint]) return angle - lower[joint];
    return 0.0;
  }

  double energy(int joint, double angle) const {
    const double depth = beyond(joint, angle);
    return 0.5 * stiffness * depth * depth;
  }

  double damping(double depth) const {  // -d torque/d rate, N m s/rad
    return 1.5 * dissipation * std::abs(stiffness * depth);
  }

  StopTorque operator()(int joint, double angle, double rate) const {
    const double depth = beyond(joint, angle);
    if (depth == 0.0 || stiffness == 0.0) return {};
    const double approach = depth > 0.0 ? rate : -rate;
    const double factor = 1.0 + 1.5 * dissipation * approach;
    if (!(factor > 0.0)) return {};
    return {-(stiffness * depth) * factor, stiffness * factor, damping(depth)};
  }

  // Elastic torque [N m] at an angle that may be off the stop again, of the end that `side` says
  // (> 0: upper).
  double elastic_torque(int joint, double side, double angle) const {
    return -stiffness * (angle - (side > 0.0 ? upper[joint] : lower[joint]));
  }
};

}  // namespace hexapod
