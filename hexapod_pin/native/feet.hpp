// One foot: its kinematics, its contact force, and the 3x3 blocks of that force's derivatives.
#pragma once

#include <Eigen/Geometry>

#include "friction.hpp"
#include "normal.hpp"
#include "terrain.hpp"

namespace hexapod {

using Mat3 = Eigen::Matrix3d;

struct ContactLaw {
  NormalLaw normal;
  FrictionLaw friction;
};

struct ContactForce {
  Vec3 force = Vec3::Zero();     // N, world axes, on the foot
  Mat3 minus_du = Mat3::Zero();  // W = -df/du, N s/m
  Vec3 minus_dz = Vec3::Zero();  // -df/dgap, N/m
};

// Force at a foot with the given gap and contact-point velocity u; W keeps the normal-to-friction
// coupling and is not symmetric.
inline ContactForce contact_force(const ContactLaw& law, const GroundPoint& ground, const Vec3& u) {
  ContactForce out;
  const Vec3& n = ground.normal;
  const double un = n.dot(u);
  const NormalForce normal = law.normal(-ground.gap, -un);
  if (normal.force <= 0.0) return out;
  const Vec3 ut = u - un * n;
  const FrictionFactor c = law.friction(ut.norm());
  const double nc = normal.force * c.ratio;
  const Vec3 direction = n - c.ratio * ut;  // f = N direction
  out.force = normal.force * direction;
  out.minus_du = nc * (Mat3::Identity() - n * n.transpose());
  out.minus_du.noalias() += (normal.force * c.slope) * ut * ut.transpose();
  out.minus_du.noalias() += normal.d_rate * direction * n.transpose();
  out.minus_dz = normal.d_depth * direction;
  return out;
}

// Kinematics of a foot in contact, world axes. Leg columns follow System::columns().
template <class LegJacobian>
struct FootState {
  Vec3 center = Vec3::Zero();  // m, relative to the base origin
  Vec3 velocity = Vec3::Zero();  // u, of the material point of contact, m/s
  GroundPoint ground{0.0, Vec3::UnitZ()};
  ContactForce contact;
  bool active = false;               // penetrates the ground
  Eigen::Matrix<double, 3, 6> jb;    // du/d(base twist, body axes)
  LegJacobian jl;                    // du/d(joint rates)
  Eigen::Matrix<double, 3, 6> qb;    // du/d(r, phi)
  LegJacobian ql;                    // du/d(joint angles)
};

}  // namespace hexapod
