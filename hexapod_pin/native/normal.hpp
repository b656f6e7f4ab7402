// Normal contact laws: force from penetration d and approach rate r = d'. Pure functions.
#pragma once

#include <algorithm>
#include <cmath>

namespace hexapod {

struct NormalForce {
  double force = 0.0;    // N, never negative
  double elastic = 0.0;  // N, the part that stores energy
  double d_depth = 0.0;  // dF/dd, N/m
  double d_rate = 0.0;   // dF/dd', N s/m
};

enum class NormalKind { hunt_crossley, adams_impact };

// hunt_crossley: F = K d^n max(0, 1 + 1.5 a d')          (Hunt & Crossley 1975; Hertz for n = 3/2, a = 0)
// adams_impact:  F = max(0, K d^n + c(d) d'), c = cmax s^2 (3 - 2s), s = min(d/depth, 1)   (S2, ADAMS IMPACT)
struct NormalLaw {
  NormalKind kind = NormalKind::hunt_crossley;
  double stiffness = 0.0;      // N/m^n
  double exponent = 1.5;       // -
  double dissipation = 0.0;    // s/m, hunt_crossley
  double damping = 0.0;        // N s/m, adams_impact
  double damping_depth = 1.0;  // m, adams_impact

  double power(double depth) const {  // d^n
    if (exponent == 1.5) return depth * std::sqrt(depth);
    if (exponent == 1.0) return depth;
    return std::pow(depth, exponent);
  }

  double energy(double depth) const {
    return depth > 0.0 ? stiffness * power(depth) * depth / (exponent + 1.0) : 0.0;
  }

  NormalForce operator()(double depth, double rate) const {
    NormalForce out;
    if (!(depth > 0.0)) return out;
    const double spring = stiffness * power(depth);
    const double slope = exponent * (spring / depth);
    out.elastic = spring;
    if (kind == NormalKind::hunt_crossley) {
      const double factor = 1.0 + 1.5 * dissipation * rate;
      if (factor > 0.0) {
        out.force = spring * factor;
        out.d_depth = slope * factor;
        out.d_rate = 1.5 * dissipation * spring;
      }
      return out;
    }
    const double s = std::min(depth / damping_depth, 1.0);
    const double c = damping * s * s * (3.0 - 2.0 * s);
    const double force = spring + c * rate;
    if (force > 0.0) {
      out.force = force;
      out.d_depth = slope + 6.0 * damping * s * (1.0 - s) / damping_depth * rate;
      out.d_rate = c;
    }
    return out;
  }
};

}  // namespace hexapod
