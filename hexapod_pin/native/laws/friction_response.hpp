// Size m of a friction force (or impulse) as a function of slip speed s and normal force (or impulse): what
// the method `robust` solves for. All other methods take `contact_force` (contact.hpp), of the same laws.
#pragma once

#include "laws/friction.hpp"

namespace hexapod {

struct FrictionResponse {
  double ratio = 0.0;       // m/s, N s/m (impulses: N s^2/m)
  double slope = 0.0;       // dm/ds, same unit
  double per_normal = 0.0;  // dm/d(normal force), -
};

// A law of the slip speed alone; `scale` multiplies its coefficients.
inline FrictionResponse sliding_response(const FrictionLaw& law, double scale, double speed,
                                         double normal) {
  const FrictionFactor f = law(speed);
  const double ratio = scale * f.ratio, slope = scale * f.tangent(speed);
  return {normal * ratio, normal * slope, ratio * speed};
}

// A bristle of that gain [N s/m] under the bound mu * normal: m = min(gain s, mu * normal).
inline FrictionResponse bristle_response(double gain, double mu, double speed, double normal) {
  if (gain * speed <= mu * normal) return {gain, gain, 0.0};
  return {mu * normal / speed, 0.0, mu};
}

}  // namespace hexapod
