// Regularised Coulomb laws: f_t = -N m(s) u_t/s with slip speed s = |u_t|. Pure functions.
#pragma once

#include <cmath>

namespace hexapod {

struct FrictionFactor {
  double ratio = 0.0;  // m(s)/s, s/m
  double slope = 0.0;  // (d ratio/ds)/s, s^3/m^3
};

enum class FrictionKind { none, tanh_coulomb, adams_coulomb };

// tanh_coulomb:  m = mu tanh(kt s)                                                (S1 eq. 5)
// adams_coulomb: m = STEP(s, -vs, -mu_s, vs, mu_s) below vs, STEP(s, vs, mu_s, vd, mu_d) above   (S2)
struct FrictionLaw {
  FrictionKind kind = FrictionKind::none;
  double mu = 0.0;               // -, tanh: the coefficient; adams: static
  double slip_slope = 0.0;       // kt, s/m
  double mu_dynamic = 0.0;       // -
  double stiction_speed = 1.0;   // vs, m/s
  double transition_speed = 2.0; // vd, m/s

  FrictionFactor operator()(double speed) const {
    switch (kind) {
      case FrictionKind::tanh_coulomb: return tanh_factor(speed);
      case FrictionKind::adams_coulomb: return adams_factor(speed);
      default: return {};
    }
  }

 private:
  FrictionFactor tanh_factor(double s) const {
    const double x = slip_slope * s;
    if (x < 1e-4) {  // tanh x / x = 1 - x^2/3
      const double k3 = slip_slope * slip_slope * slip_slope;
      return {mu * slip_slope * (1.0 - x * x / 3.0), -2.0 / 3.0 * mu * k3};
    }
    const double t = x > 20.0 ? 1.0 : std::tanh(x);  // 1 - tanh(20) is below one rounding
    const double ratio = mu * t / s;
    return {ratio, (mu * slip_slope * (1.0 - t * t) - ratio) / (s * s)};
  }

  FrictionFactor adams_factor(double s) const {
    if (s < stiction_speed) {  // STEP from -vs to vs: mu_s x (3 - x^2)/2, x = s/vs
      const double vs2 = stiction_speed * stiction_speed;
      return {0.5 * mu / stiction_speed * (3.0 - s * s / vs2), -mu / (stiction_speed * vs2)};
    }
    const double width = transition_speed - stiction_speed;
    const double y = s < transition_speed ? (s - stiction_speed) / width : 1.0;
    const double m = mu + (mu_dynamic - mu) * y * y * (3.0 - 2.0 * y);
    const double dm = (mu_dynamic - mu) * 6.0 * y * (1.0 - y) / width;
    return {m / s, (dm - m / s) / (s * s)};
  }
};

}  // namespace hexapod
