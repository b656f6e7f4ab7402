// Joint stops: a spring with dissipation beyond each end of a joint's range, never pulling.
//   torque = -K d max(0, 1 + 1.5 a d'), d how far the joint is beyond its limit
// Units are those of joints that turn; of joints that slide N for N m and m for rad.
#pragma once

#include <algorithm>
#include <cmath>

#include "laws/vectors.hpp"

namespace hexapod {

// In the range, pressed against one of its ends, or beyond it on a stop that would pull.
enum class StopMode : signed char {
  lower_released = -2, lower = -1, free = 0, upper = 1, upper_released = 2
};

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
  VectorXd stiffness;        // K, N m/rad; 0: no stops
  double dissipation = 0.0;  // a, s/rad

  bool present(int joint) const { return stiffness[joint] > 0.0; }
  bool present() const { return stiffness.size() > 0 && stiffness.maxCoeff() > 0.0; }

  double beyond(int joint, double angle) const {  // > 0 above the range, < 0 below it, rad
    if (angle > upper[joint]) return angle - upper[joint];
    if (angle < lower[joint]) return angle - lower[joint];
    return 0.0;
  }

  double energy(int joint, double angle) const {
    const double depth = beyond(joint, angle);
    return 0.5 * stiffness[joint] * depth * depth;
  }

  double damping(int joint, double depth) const {  // -d torque/d rate, N m s/rad
    return 1.5 * dissipation * std::abs(stiffness[joint] * depth);
  }

  StopMode mode(int joint, double angle, double rate) const {
    const double depth = beyond(joint, angle);
    if (depth == 0.0 || stiffness[joint] == 0.0) return StopMode::free;
    if (depth > 0.0) return factor(rate) > 0.0 ? StopMode::upper : StopMode::upper_released;
    return factor(-rate) > 0.0 ? StopMode::lower : StopMode::lower_released;
  }

  // In a mode that is known, beyond the mode's ends too.
  StopTorque on(int joint, StopMode mode, double angle, double rate) const {
    if (mode == StopMode::upper) return pressed(joint, angle - upper[joint], rate, 1.0);
    if (mode == StopMode::lower) return pressed(joint, angle - lower[joint], rate, -1.0);
    return {};
  }

  StopTorque operator()(int joint, double angle, double rate) const {
    return on(joint, mode(joint, angle, rate), angle, rate);
  }

  // Elastic torque [N m] at an angle that may be off the stop again, of the end that `side` says
  // (> 0: upper).
  double elastic_torque(int joint, double side, double angle) const {
    return -stiffness[joint] * (angle - (side > 0.0 ? upper[joint] : lower[joint]));
  }

  // Where a mode ends: N m, above zero inside. The first by the angle, the second by the rate.
  void switches(int joint, StopMode mode, double angle, double rate, double& by_angle,
                double& by_rate) const {
    if (!present(joint)) return;
    const double above = stiffness[joint] * (angle - upper[joint]);
    const double below = stiffness[joint] * (lower[joint] - angle);
    switch (mode) {
      case StopMode::free: by_angle = -std::max(above, below); break;
      case StopMode::upper: by_angle = above, by_rate = std::abs(above) * factor(rate); break;
      case StopMode::lower: by_angle = below, by_rate = std::abs(below) * factor(-rate); break;
      case StopMode::upper_released: by_angle = above, by_rate = -std::abs(above) * factor(rate); break;
      case StopMode::lower_released: by_angle = below, by_rate = -std::abs(below) * factor(-rate); break;
    }
  }

 private:
  double factor(double approach) const { return 1.0 + 1.5 * dissipation * approach; }

  StopTorque pressed(int joint, double depth, double rate, double side) const {
    const double grown = factor(side * rate), elastic = stiffness[joint] * depth;
    return {-elastic * grown, stiffness[joint] * grown, 1.5 * dissipation * (side * elastic)};
  }
};

}  // namespace hexapod
