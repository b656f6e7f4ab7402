// What the servos of all joints are to follow at one time.
#pragma once

#include "plant/reference.hpp"

namespace hexapod {

struct SetPoints {
  VectorXd q, v, torque;  // rad, rad/s, N m

  explicit SetPoints(int joints)
      : q(VectorXd::Zero(joints)), v(q), torque(q) {}

  void take(Reference& reference, double t) {
    reference.at(t, q, v);
    torque = reference.torque();
  }
};

}  // namespace hexapod
