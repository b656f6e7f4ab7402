// What a contact remembers between steps; the laws themselves are pure.
#pragma once

#include <Eigen/Core>

namespace hexapod {

struct ContactMemory {
  double touch_speed = 0.0;                           // approach speed before first touch, m/s
  Eigen::Vector3d stretch = Eigen::Vector3d::Zero();  // of the bristle, in the ground plane, m
  bool touching = false;
  bool sliding = false;  // the bristle ended the last step on the cone

  void let_go() { *this = ContactMemory{touch_speed, Eigen::Vector3d::Zero(), false, false}; }
};

}  // namespace hexapod
