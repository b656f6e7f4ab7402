#include "laws/contact.hpp"

namespace hexapod {

namespace {

// A law of the slip speed alone, with the secant correction of `contact`.
TangentialForce sliding_force(const FrictionLaw& law, double scale, double normal_force,
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

}  // namespace

// The laws are small: a call of each would cost a percent of a step.
[[gnu::flatten]] ContactForce contact_force(const ContactLaw& law, const GroundPoint& ground, const Vec3& u,
                                            const ContactMemory& memory, double implicit_dt, double mu_scale,
                                            double k_scale, bool pieces_frozen) {
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
