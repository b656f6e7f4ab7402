// Force at one contact of a foot, and the 3x3 blocks of its derivatives.
#pragma once

#include "laws/bristle.hpp"
#include "laws/contact_memory.hpp"
#include "laws/friction.hpp"
#include "laws/ground.hpp"
#include "laws/normal.hpp"
#include "laws/vectors.hpp"

namespace hexapod {

struct ContactLaw {
  NormalLaw normal;
  FrictionLaw friction;
};

struct ContactForce {
  Vec3 force = Vec3::Zero();     // N, world axes, on the foot
  Mat3 minus_du = Mat3::Zero();  // W = -df/du, N s/m
  Vec3 minus_dz = Vec3::Zero();  // -df/dgap, N/m
  bool softens = false;          // friction past its peak: the secant differs from the tangent
  Mat3 secant_correction = Mat3::Zero();  // turns W into the secant -f_t/u, where that is more

  Mat3 slope(bool secant) const { return secant ? Mat3(minus_du + secant_correction) : minus_du; }
};

// Friction here is that of a known slip speed; `robust` solves for it (friction_response.hpp).

// A law of the slip speed alone, with the secant correction of `contact`.
inline TangentialForce sliding_force(const FrictionLaw& law, double scale, double normal_force,
                                     const Vec3& ut, const Mat3& plane, ContactForce& contact) {
  const FrictionFactor c = law(ut.norm());
  TangentialForce out;
  out.per_normal = -scale * c.ratio * ut;
  out.minus_du = (scale * normal_force * c.ratio) * plane;
  const Mat3 radial = (scale * normal_force * c.slope) * ut * ut.transpose();
  out.minus_du += radial;
  contact.softens = c.slope < 0.0;
  if (contact.softens) contact.secant_correction = -radial;
  return out;
}

// Force at a contact with the given gap and contact-point velocity u (relative to the ground); W
// keeps the normal-to-friction coupling and is not symmetric. The scales multiply mu and K (patches).
// `pieces_frozen`: the contact keeps pressing or is released, and its bristle stays stuck or sliding, as it
// remembers.
inline ContactForce contact_force(const ContactLaw& law, const GroundPoint& ground, const Vec3& u,
                                  const ContactMemory& memory, double implicit_dt, double mu_scale,
                                  double k_scale, bool pieces_frozen = false) {
  ContactForce out;
  const Vec3& n = ground.normal;
  const double un = n.dot(u);
  const NormalPiece pressing = !pieces_frozen    ? NormalPiece::by_force
                               : memory.released ? NormalPiece::released
                                                 : NormalPiece::pressing;
  NormalForce normal = law.normal(-ground.gap, -un, memory.touch_speed, pressing);
  if (pressing != NormalPiece::pressing && normal.force <= 0.0) return out;
  if (k_scale != 1.0) {
    normal.force *= k_scale;
    normal.d_depth *= k_scale;
    normal.d_rate *= k_scale;
  }
  const Vec3 ut = u - un * n;
  const Mat3 plane = Mat3::Identity() - n * n.transpose();
  const FrictionLaw& friction = law.friction;
  const BristlePiece piece = !pieces_frozen   ? BristlePiece::by_force
                             : memory.sliding ? BristlePiece::sliding
                                              : BristlePiece::stuck;
  const TangentialForce t =
      friction.has_bristle()
          ? bristle_force(friction, mu_scale * friction.coefficient(memory.sliding), normal.force,
                          ut, plane, memory.stretch, implicit_dt, piece)
          : sliding_force(friction, mu_scale, normal.force, ut, plane, out);
  const Vec3 direction = n + t.per_normal;  // df/dN
  out.force = normal.force * direction + t.independent;
  out.minus_du = t.minus_du;
  out.minus_du.noalias() += normal.d_rate * direction * n.transpose();
  out.minus_dz = normal.d_depth * direction;
  return out;
}

}  // namespace hexapod
