// A bristle, `StickSlip` in Python (Cundall & Strack 1979; of neither paper): a spring and a damper side
// by side in the ground plane, in series with a slider that slips at mu N. z' = (F - k P z)/c with the
// stretch z, its part P z in the plane and the force F through them; where the plane turns, what is left
// across it waits unused. Pure functions.
#pragma once

#include <algorithm>

#include "laws/contact_memory.hpp"
#include "laws/friction.hpp"
#include "laws/vectors.hpp"

namespace hexapod {

// A tangential force, split by what it does when the normal force N changes.
struct TangentialForce {
  Vec3 per_normal = Vec3::Zero();   // f_t / N where f_t follows N, else 0
  Vec3 independent = Vec3::Zero();  // f_t that does not follow N (a sticking bristle), N
  Mat3 minus_du = Mat3::Zero();     // -df_t/du at constant N, N s/m
};

// Which piece of the law holds: the one that the force asks for, or one that is frozen and holds beyond
// its ends too, so that the force is smooth.
enum class BristlePiece { by_force, stuck, sliding };

// Trial force k (z + dt u_t) + c u_t, scaled back onto the cone mu N. `implicit_dt` is the step of a
// method that takes forces at its end, 0 for a stage of an explicit one.
inline TangentialForce bristle_force(const FrictionLaw& law, double mu, double normal_force,
                                     const Vec3& ut, const Mat3& plane, const Vec3& stretch,
                                     double implicit_dt, BristlePiece piece) {
  TangentialForce out;
  const double gain = law.bristle_gain(implicit_dt);
  const Vec3 trial = law.bristle_stiffness * (plane * stretch) + gain * ut;
  const double size = trial.norm(), cap = mu * normal_force;
  const bool sticks = piece == BristlePiece::by_force ? size <= cap : piece == BristlePiece::stuck;
  if (sticks || size == 0.0) {
    out.independent = -trial;
    out.minus_du = gain * plane;
    return out;
  }
  const Vec3 e = trial / size;
  out.per_normal = -mu * e;
  out.minus_du = (cap / size * gain) * (plane - e * e.transpose());
  return out;
}

inline Vec3 in_plane(const Vec3& n, const Vec3& x) { return x - n.dot(x) * n; }

// Force through the bristle of a foot that feels f.
inline Vec3 through_bristle(const Vec3& n, const Vec3& f) { return n.dot(f) * n - f; }

// One backward Euler step dt of z' under the force f on the foot; for c = 0 the spring alone carries
// F. Never makes energy: F.u dt = F.(z+ - z) + F.slip dt with F = k z+ + c (z+ - z)/dt, and the slip
// is along F.
inline Vec3 next_stretch(const FrictionLaw& law, const Vec3& n, const Vec3& f, const Vec3& stretch,
                         double dt) {
  const Vec3 through = through_bristle(n, f), flat = in_plane(n, stretch);
  return stretch - flat + (law.bristle_damping * flat + dt * through) / law.bristle_gain(dt);
}

// z' of a bristle (c > 0) where the foot feels f.
inline Vec3 stretch_rate(const FrictionLaw& law, const Vec3& n, const Vec3& f, const Vec3& stretch) {
  const Vec3 through = through_bristle(n, f), flat = in_plane(n, stretch);
  return (through - law.bristle_stiffness * flat) / law.bristle_damping;
}

// Whether the force f on the foot is at the friction cone.
inline bool at_cone(const FrictionLaw& law, double mu_scale, const Vec3& n, const Vec3& f,
                    bool sliding) {
  const double mu = mu_scale * law.coefficient(sliding), normal = n.dot(f);
  return (f - normal * n).norm() >= mu * std::max(0.0, normal) * (1.0 - 1e-9);
}

// How far [N] a bristle is inside of its piece of the law under a normal force N: a stuck one breaks away
// where its trial force k z + c u_t reaches mu N, a sliding one sticks again where that falls to
// mu_dynamic N, the slip (|k z + c u_t| - mu_dynamic N)/c being zero. Negative beyond the end.
inline double piece_margin(const FrictionLaw& law, double mu_scale, double normal_force, double trial,
                           bool sliding) {
  const double excess = trial - mu_scale * law.coefficient(sliding) * normal_force;
  return sliding ? excess : -excess;
}

// Moves the bristle of a contact by a step dt that ends with the force f on the foot.
inline void update_bristle(const FrictionLaw& law, double mu_scale, const Vec3& n, const Vec3& f,
                           double dt, ContactMemory& memory) {
  memory.stretch = next_stretch(law, n, f, memory.stretch, dt);
  memory.sliding = at_cone(law, mu_scale, n, f, memory.sliding);
}

}  // namespace hexapod
