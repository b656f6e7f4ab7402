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
// Force at a contact with the given gap and contact-point velocity u (relative to the ground); W
// keeps the normal-to-friction coupling and is not symmetric. The scales multiply mu and K (patches).
// `pieces_frozen`: the contact keeps pressing or is released, and its bristle stays stuck or sliding, as it
// remembers.
ContactForce contact_force(const ContactLaw& law, const GroundPoint& ground, const Vec3& u,
                           const ContactMemory& memory, double implicit_dt, double mu_scale,
                           double k_scale, bool pieces_frozen = false);

}  // namespace hexapod
