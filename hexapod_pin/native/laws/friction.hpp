// Regularised Coulomb laws: f_t = -N m(s) u_t/s with slip speed s = |u_t|. Pure functions.
#pragma once

#include <algorithm>
#include <cmath>

namespace hexapod {

struct FrictionFactor {
  double ratio = 0.0;  // m(s)/s, s/m
  double slope = 0.0;  // (d ratio/ds)/s, s^3/m^3

  double tangent(double speed) const { return ratio + slope * speed * speed; }  // dm/ds, s/m
};

enum class FrictionKind { none, tanh_coulomb, adams_coulomb, smooth_step, brown_mcphee, bristle };

// tanh_coulomb:  m = mu tanh(kt s)                                                (S1 eq. 5)
// adams_coulomb: m = STEP(s, -vs, -mu, vs, mu) below vs, STEP(s, vs, mu, vd, mud) above   (S2)
// smooth_step:   m = mu S5(x), x = s/vs < 1; then down to mud over 1 <= x < 3     (Drake)
// brown_mcphee:  m = mud tanh(4x) + (mu - mud) x/(0.25 x^2 + 0.75)^2, x = s/vs    (Brown & McPhee)
// bristle:       `StickSlip` in Python: a spring and damper in the ground plane (bristle.hpp; Cundall & Strack)
struct FrictionLaw {
  FrictionKind kind = FrictionKind::none;
  double mu = 0.0;                 // -, static where there are two
  double mu_dynamic = 0.0;         // -
  double slip_slope = 0.0;         // kt, s/m
  double stiction_speed = 1.0;     // vs, m/s
  double transition_speed = 2.0;   // vd, m/s
  double bristle_stiffness = 0.0;  // k, N/m
  double bristle_damping = 0.0;    // c, N s/m

  bool has_bristle() const { return kind == FrictionKind::bristle; }

  // Coefficient that bounds the force of a bristle, -.
  double coefficient(bool sliding) const { return sliding ? mu_dynamic : mu; }
  double largest_coefficient() const { return std::max(mu, mu_dynamic); }

  // d force/d slip speed [N s/m] of a bristle that a step `dt` [s] stretches along; 0 s: the damper.
  double bristle_gain(double dt) const { return dt * bristle_stiffness + bristle_damping; }
  double bristle_energy(double stretch_squared) const {  // J, of a stretch [m] squared
    return 0.5 * bristle_stiffness * stretch_squared;
  }
  double bristle_relaxation() const { return bristle_stiffness / bristle_damping; }  // 1/s

  // Slip speed per stretch [1/s] that gives the same trial force at the end of a step `dt` [s].
  double bristle_slip_rate(double dt) const { return bristle_stiffness / bristle_gain(dt); }

  // Slope of m/mu at rest (smooth_step: its largest), s/m: the inverse of the slip speed that the law
  // resolves; 0 for the others.
  double steepness() const {
    switch (kind) {
      case FrictionKind::tanh_coulomb: return slip_slope;
      case FrictionKind::adams_coulomb: return 1.5 / stiction_speed;
      case FrictionKind::smooth_step: return 1.875 / stiction_speed;
      case FrictionKind::brown_mcphee: return 4.0 / stiction_speed;
      default: return 0.0;
    }
  }

  double largest_ratio() const {  // of m(s)/s, s/m
    if (kind == FrictionKind::smooth_step) return 1.2 * mu / stiction_speed;
    return (*this)(0.0).ratio;
  }

  FrictionFactor operator()(double speed) const {
    switch (kind) {
      case FrictionKind::tanh_coulomb: return tanh_factor(mu, slip_slope, speed);
      case FrictionKind::adams_coulomb: return adams_factor(speed);
      case FrictionKind::smooth_step: return smooth_step_factor(speed);
      case FrictionKind::brown_mcphee: return brown_mcphee_factor(speed);
      default: return {};
    }
  }

 private:
  // c tanh(k s)/s
  static FrictionFactor tanh_factor(double c, double k, double s) {
    const double x = k * s;
    if (x < 1e-4) return {c * k * (1.0 - x * x / 3.0), -2.0 / 3.0 * c * k * k * k};
    const double t = x > 20.0 ? 1.0 : std::tanh(x);  // 1 - tanh(20) is below one rounding
    const double ratio = c * t / s;
    return {ratio, (c * k * (1.0 - t * t) - ratio) / (s * s)};
  }

  static FrictionFactor from_values(double m, double dm, double s) {
    return {m / s, (dm - m / s) / (s * s)};
  }

  FrictionFactor adams_factor(double s) const {
    if (s < stiction_speed) {  // STEP from -vs to vs: mu x (3 - x^2)/2, x = s/vs
      const double vs2 = stiction_speed * stiction_speed;
      return {0.5 * mu / stiction_speed * (3.0 - s * s / vs2), -mu / (stiction_speed * vs2)};
    }
    const double width = transition_speed - stiction_speed;
    const double y = s < transition_speed ? (s - stiction_speed) / width : 1.0;
    const double m = mu + (mu_dynamic - mu) * y * y * (3.0 - 2.0 * y);
    return from_values(m, (mu_dynamic - mu) * 6.0 * y * (1.0 - y) / width, s);
  }

  // S5(x) = x^3 (10 - x (15 - 6 x)), S5' = 30 x^2 (1 - x)^2
  FrictionFactor smooth_step_factor(double s) const {
    const double v = stiction_speed, x = s / v;
    if (x < 1.0) {  // S5(x)/x = x^2 (10 - x (15 - 6x)); its derivative over x stays finite
      const double ratio = mu / v * x * x * (10.0 - x * (15.0 - 6.0 * x));
      return {ratio, mu / (v * v * v) * (20.0 - x * (45.0 - 24.0 * x))};
    }
    const double y = x < 3.0 ? 0.5 * (x - 1.0) : 1.0;
    const double m = mu + (mu_dynamic - mu) * y * y * y * (10.0 - y * (15.0 - 6.0 * y));
    return from_values(m, (mu_dynamic - mu) * 30.0 * y * y * (1.0 - y) * (1.0 - y) * 0.5 / v, s);
  }

  FrictionFactor brown_mcphee_factor(double s) const {
    const double v = stiction_speed, x = s / v, d = 0.25 * x * x + 0.75;
    const FrictionFactor rise = tanh_factor(mu_dynamic, 4.0 / v, s);
    const double peak = (mu - mu_dynamic) / (v * d * d);
    return {rise.ratio + peak, rise.slope - peak / (d * v * v)};
  }
};

}  // namespace hexapod
