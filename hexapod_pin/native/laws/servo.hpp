// Joint servos: PD about a moving set-point with a torque limit, and passive viscous joint damping.
#pragma once

#include <algorithm>

#include <Eigen/Core>

namespace hexapod {

struct Servo {
  Eigen::VectorXd kp;       // N m/rad
  Eigen::VectorXd kd;       // N m s/rad
  Eigen::VectorXd limit;    // N m, may be infinite
  Eigen::VectorXd damping;  // N m s/rad, of the joint itself

  double clip(int joint, double torque) const {
    return std::clamp(torque, -limit[joint], limit[joint]);
  }

  double torque(int joint, double error, double rate_error) const {
    return clip(joint, kp[joint] * error + kd[joint] * rate_error);
  }
};

}  // namespace hexapod
