// Normal contact laws: force from penetration d and approach rate r = d'. Pure functions.
#pragma once

#include <algorithm>
#include <cmath>

namespace hexapod {

struct NormalForce {
  double force = 0.0;    // N, not negative unless the piece of the law is frozen
  double elastic = 0.0;  // N, the part that stores energy
  double d_depth = 0.0;  // dF/dd, N/m
  double d_rate = 0.0;   // dF/dd', N s/m
};

// Which piece of the law holds: the one that the force asks for, or one that is frozen and holds beyond
// its ends too, so that the force is smooth: pressing, where it may pull, or released, where it is zero.
enum class NormalPiece { by_force, pressing, released };

enum class NormalKind { hunt_crossley, restitution, kelvin_voigt, adams_impact };

// hunt_crossley: F = K d^n max(0, 1 + 1.5 a d')     (Hunt & Crossley 1975; Hertz for n = 3/2, a = 0)
// restitution:   F = K d^n max(0, 1 + eta d'/v0)    (S1 eq. 4, exponent restored; v0 at first touch)
// kelvin_voigt:  F = max(0, K d^n + c d')           (jumps at touch-down; a baseline)
// adams_impact:  F = max(0, K d^n + c(d) d'), c = cmax s^2 (3 - 2s), s = min(d/depth, 1)   (S2)
struct NormalLaw {
  NormalKind kind = NormalKind::hunt_crossley;
  double stiffness = 0.0;      // K, N/m^n
  double exponent = 1.5;       // n, -
  double dissipation = 0.0;    // a, s/m
  double eta = 0.0;            // -
  double speed_floor = 1e-3;   // least v0, m/s
  double damping = 0.0;        // c or cmax, N s/m
  double damping_depth = 1.0;  // m

  bool needs_touch_speed() const { return kind == NormalKind::restitution; }

  // True for F = K d^n max(0, 1 + gain d'): damping in proportion to the spring.
  bool damping_follows_spring() const {
    return kind == NormalKind::hunt_crossley || kind == NormalKind::restitution;
  }

  double damping_gain(double touch_speed) const {  // of such a law, s/m
    return kind == NormalKind::hunt_crossley ? 1.5 * dissipation
                                             : eta / std::max(touch_speed, speed_floor);
  }

  double spring(double depth) const {  // K d^n, N
    return depth <= 0.0 ? 0.0 : stiffness * power(depth);
  }

  // factor * d spring/dd [N/m] from the spring force at a depth above zero.
  double spring_slope(double spring, double depth, double factor = 1.0) const {
    return factor * exponent * spring / depth;
  }

  double depth_of(double normalised) const {  // d of d^n, m
    return std::pow(normalised, 1.0 / exponent);
  }

  // Energy [J] behind a spring force at its depth.
  double spring_energy(double spring, double depth) const {
    return spring * depth / (exponent + 1.0);
  }

  double energy(double depth) const {
    return depth > 0.0 ? spring_energy(stiffness * power(depth), depth) : 0.0;
  }

  // Whether its damper can pull, so that the force is cut off at zero while the contact still has depth.
  bool can_release() const {
    return kind == NormalKind::hunt_crossley ? dissipation > 0.0
           : kind == NormalKind::restitution ? eta > 0.0
                                             : damping > 0.0;
  }

  NormalForce operator()(double depth, double rate, double touch_speed = 0.0,
                         NormalPiece piece = NormalPiece::by_force) const {
    if (!(depth > 0.0)) return {};
    const double spring = stiffness * power(depth);
    const auto ends = [piece](double sign) {
      return piece == NormalPiece::released || (piece == NormalPiece::by_force && !(sign > 0.0));
    };
    const double slope = exponent * (spring / depth);
    if (damping_follows_spring()) {
      const double gain = damping_gain(touch_speed), factor = 1.0 + gain * rate;
      if (ends(factor)) return {0.0, spring, 0.0, 0.0};
      return {spring * factor, spring, slope * factor, gain * spring};
    }
    const double s = kind == NormalKind::kelvin_voigt ? 1.0 : std::min(depth / damping_depth, 1.0);
    const double c = damping * s * s * (3.0 - 2.0 * s);
    const double force = spring + c * rate;
    if (ends(force)) return {0.0, spring, 0.0, 0.0};
    return {force, spring, slope + 6.0 * damping * s * (1.0 - s) / damping_depth * rate, c};
  }

  // Force with which contact begins at an approach rate [m/s], N: not zero where the law jumps.
  double first_force(double rate) const {
    return kind == NormalKind::kelvin_voigt ? std::max(0.0, damping * rate) : 0.0;
  }

 private:
  double power(double depth) const {  // d^n
    if (exponent == 1.5) return depth * std::sqrt(depth);
    if (exponent == 1.0) return depth;
    return std::pow(depth, exponent);
  }
};

}  // namespace hexapod
