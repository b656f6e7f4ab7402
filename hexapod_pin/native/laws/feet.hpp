// One contact of a foot: its kinematics, its force, and the 3x3 blocks of the force's derivatives.
#pragma once

#include <algorithm>

#include <Eigen/Geometry>

#include "laws/friction.hpp"
#include "laws/ground.hpp"
#include "laws/memory.hpp"
#include "laws/normal.hpp"
#include "plant/dynamics.hpp"

namespace hexapod {

struct ContactLaw {
  NormalLaw normal;
  FrictionLaw friction;
};

struct ContactForce {
  Vec3 force = Vec3::Zero();     // N, world axes, on the foot
  Mat3 minus_du = Mat3::Zero();  // W = -df/du, N s/m
  Vec3 minus_dz = Vec3::Zero();  // -df/dgap, N/m
  bool bends = false;            // the secant differs from the tangent
  Mat3 bend = Mat3::Zero();      // what turns the tangent W into the secant -f_t/u, where that is more
};

// The tangential force over N, -direction in the plane, and its own derivative to u.
struct Tangential {
  Vec3 over_n = Vec3::Zero();    // f_t / N where f_t follows N, else 0
  Vec3 fixed = Vec3::Zero();     // f_t that does not follow N (a sticking bristle), N
  Mat3 minus_du = Mat3::Zero();  // -df_t/du at constant N
};

// Bristle: trial force k (z + lead u_t) + c u_t = kappa w, scaled back onto the cone mu N. `lead` is
// the step of an implicit method, 0 for a stage of an explicit one.
inline Tangential bristle(const FrictionLaw& law, double mu, double n_force, const Vec3& ut,
                          const Mat3& plane, const Vec3& stretch, double lead) {
  Tangential out;
  const double kappa = lead * law.bristle_stiffness + law.bristle_damping;
  const Vec3 trial = law.bristle_stiffness * stretch + kappa * ut;
  const double size = trial.norm(), cap = mu * n_force;
  if (size <= cap) {
    out.fixed = -trial;
    out.minus_du = kappa * plane;
    return out;
  }
  const Vec3 e = trial / size;
  out.over_n = -mu * e;
  out.minus_du = (cap / size * kappa) * (plane - e * e.transpose());
  return out;
}

// The bristle is a spring and a damper side by side, in line with a slider that gives way at mu N:
// z' = (F - k z)/c with F the force through them. One backward Euler step h of that under the force
// f on the foot; for c = 0 the spring alone carries F. Never makes energy: F.u h = F.(z+ - z) + F.slip h
// with F = k z+ + c (z+ - z)/h, and the slip is along F.
inline Vec3 moved_bristle(const FrictionLaw& law, const Vec3& n, const Vec3& f, const Vec3& stretch,
                          double h) {
  const Vec3 through = n.dot(f) * n - f, flat = stretch - n.dot(stretch) * n;
  return (law.bristle_damping * flat + h * through) /
         (law.bristle_damping + h * law.bristle_stiffness);
}

// z' of a bristle (c > 0) where the foot feels f.
inline Vec3 bristle_rate(const FrictionLaw& law, const Vec3& n, const Vec3& f, const Vec3& stretch) {
  const Vec3 through = n.dot(f) * n - f, flat = stretch - n.dot(stretch) * n;
  return (through - law.bristle_stiffness * flat) / law.bristle_damping;
}

// Whether the force through a bristle is at the cone.
inline bool slides(const FrictionLaw& law, double mu_scale, const Vec3& n, const Vec3& f,
                   bool sliding) {
  const double mu = mu_scale * (sliding ? law.mu_dynamic : law.mu), push = n.dot(f);
  return (f - push * n).norm() >= mu * std::max(0.0, push) * (1.0 - 1e-9);
}

// Moves the bristle of a contact by a step h that ends with the force f on the foot.
inline void stretch_bristle(const FrictionLaw& law, double mu_scale, const Vec3& n, const Vec3& f,
                            double h, ContactMemory& memory) {
  memory.stretch = moved_bristle(law, n, f, memory.stretch, h);
  memory.sliding = slides(law, mu_scale, n, f, memory.sliding);
}

inline Tangential sliding(const FrictionLaw& law, double scale, double n_force, const Vec3& ut,
                          const Mat3& plane, ContactForce& contact) {
  const FrictionFactor c = law(ut.norm());
  Tangential out;
  out.over_n = -scale * c.ratio * ut;
  out.minus_du = (scale * n_force * c.ratio) * plane;
  const Mat3 radial = (scale * n_force * c.slope) * ut * ut.transpose();
  out.minus_du += radial;
  contact.bends = c.slope < 0.0;
  if (contact.bends) contact.bend = -radial;
  return out;
}

// Force at a contact with the given gap and contact-point velocity u (relative to the ground); W
// keeps the normal-to-friction coupling and is not symmetric. `scale` multiplies mu and K (patches).
inline ContactForce contact_force(const ContactLaw& law, const GroundPoint& ground, const Vec3& u,
                                  const ContactMemory& memory, double lead, double mu_scale,
                                  double k_scale) {
  ContactForce out;
  const Vec3& n = ground.normal;
  const double un = n.dot(u);
  NormalForce normal = law.normal(-ground.gap, -un, memory.touch_speed);
  if (normal.force <= 0.0) return out;
  if (k_scale != 1.0) {
    normal.force *= k_scale;
    normal.d_depth *= k_scale;
    normal.d_rate *= k_scale;
  }
  const Vec3 ut = u - un * n;
  const Mat3 plane = Mat3::Identity() - n * n.transpose();
  const FrictionLaw& f = law.friction;
  const double mu = mu_scale * (memory.sliding ? f.mu_dynamic : f.mu);
  const Tangential t = f.kind == FrictionKind::bristle
                           ? bristle(f, mu, normal.force, ut, plane, memory.stretch, lead)
                           : sliding(f, mu_scale, normal.force, ut, plane, out);
  const Vec3 direction = n + t.over_n;  // df/dN
  out.force = normal.force * direction + t.fixed;
  out.minus_du = t.minus_du;
  out.minus_du.noalias() += normal.d_rate * direction * n.transpose();
  out.minus_dz = normal.d_depth * direction;
  return out;
}

// Kinematics of a contact, world axes. Leg columns follow System::columns().
template <class LegJacobian>
struct FootState {
  Vec3 center = Vec3::Zero();    // m, relative to the base origin
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
