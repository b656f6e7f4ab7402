// Joint servos: PD about a moving set-point with a torque limit, and passive viscous joint damping.
#pragma once

#include <algorithm>
#include <cmath>

#include "laws/vectors.hpp"

namespace hexapod {

// Side of the torque limit at which a servo is: +1 or -1; 0 within the limit.
using LimitSide = int;

struct ServoGains {
  double stiffness = 0.0;  // -d torque/d angle, N m/rad
  double damping = 0.0;    // -d torque/d rate, N m s/rad
};

// One entry per joint.
struct ServoLaw {
  VectorXd kp;       // N m/rad
  VectorXd kd;       // N m s/rad
  VectorXd limit;    // N m, may be infinite
  VectorXd damping;  // N m s/rad, of the joint itself

  // Relative excess over the limit [-] that a solve's round-off may leave.
  static constexpr double kLimitSlack = 1e-12;

  void disable(int joint) { kp[joint] = kd[joint] = limit[joint] = 0.0; }

  // PD torque before the limit, N m, for errors of angle [rad] and rate [rad/s].
  double demand(int joint, double error, double rate_error) const {
    return kp[joint] * error + kd[joint] * rate_error;
  }

  // A demand after the joint has moved by `angle` [rad] and its rate by `rate` [rad/s].
  double demand_after(int joint, double demand, double angle, double rate) const {
    return demand - kp[joint] * angle - kd[joint] * rate;
  }

  double clip(int joint, double demand) const {
    return std::clamp(demand, -limit[joint], limit[joint]);
  }

  double torque(int joint, double error, double rate_error) const {
    return clip(joint, demand(joint, error, rate_error));
  }

  // The side of the limit that a demand exceeds; 0 for one that is not a number.
  LimitSide saturation(int joint, double demand, double slack = 0.0) const {
    if (!(std::abs(demand) > limit[joint] * (1.0 + slack))) return 0;
    return demand > 0.0 ? 1 : -1;
  }

  // Torque of a servo whose side is known: linear in the demand within the limit, constant at it.
  double torque_on(int joint, LimitSide side, double demand) const {
    return side == 0 ? demand : side * limit[joint];
  }
  ServoGains gains(int joint, LimitSide side) const {
    return side == 0 ? ServoGains{kp[joint], kd[joint]} : ServoGains{};
  }
};

}  // namespace hexapod
