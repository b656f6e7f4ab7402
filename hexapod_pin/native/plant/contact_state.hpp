// Kinematics and force of one contact at one state, world axes.
#pragma once

#include "laws/contact.hpp"

namespace hexapod {

// Leg columns follow System::columns().
template <class LegJacobian>
struct ContactState {
  Vec3 center = Vec3::Zero();    // of the foot's sphere, m, relative to the base origin
  Vec3 velocity = Vec3::Zero();  // u, of the material point of contact to the ground, m/s
  GroundPoint ground;
  double mu_scale = 1.0, k_scale = 1.0;  // of the patch it stands on
  ContactForce contact;
  ContactMemory memory;
  bool active = false;             // penetrates the ground
  Eigen::Matrix<double, 3, 6> jb;  // du/d(base twist, body axes)
  LegJacobian jl;                  // du/d(joint rates)
  Eigen::Matrix<double, 3, 6> qb;  // du/d(r, phi)
  LegJacobian ql;                  // du/d(joint angles)
};

}  // namespace hexapod
