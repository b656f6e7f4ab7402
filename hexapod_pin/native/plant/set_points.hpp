// What the servos of all joints are to follow at one time.
#pragma once

#include "plant/reference.hpp"

namespace hexapod {

struct SetPoints {
  VectorXd q, v, torque;  // rad, rad/s, N m
  VectorXd a;             // rad/s^2, of prescribed motions

  explicit SetPoints(int joints)
      : q(VectorXd::Zero(joints)), v(q), torque(q), a(q) {}

  void take(Reference& reference, double t) {
    reference.at(t, q, v);
    torque = reference.torque();
  }

  void take_motion(Reference& reference, double t) { reference.at(t, q, v, a); }
};

}  // namespace hexapod
