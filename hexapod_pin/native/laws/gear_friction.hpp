// Friction of a gear that grows with what the gear carries: models M1 to M6 of Duclusaud, Passault et al.,
// "Extended Friction Models for the Physics Simulation of Servo Actuators" (ICRA 2025). With the motor's
// torque u and the load's e, both counted along the motion, and the speed w >= 0,
//   F = Fc + s Fs + |Ke e - Km u| + s |Kes e - Kms u| + s Q,   s = exp(-(w / ws)^a)
//   Q = Qe e^2 where they oppose each other and |e| < |u|, Qm u^2 where |e| > |u|, else 0
// The load is one of two:
// - what the gear passes on, e = F + viscous w - u. So F is a function of one joint's own motor torque and
//   speed, or of the torque passed on and the speed; the rotor's inertia counts as load.
// - external, as BAM's: all that acts on the joint but its motor and its friction, inertial forces left out
//   (gravity, contacts, pushes, stops). F is then a function of both torques and the speed.
#pragma once

#include <algorithm>
#include <cmath>

namespace hexapod {

// Friction F [N m], its slopes in the torque that was given [-] and in the speed [N m s/rad]; the slope in an
// external load [-].
struct GearResponse {
  double friction = 0.0, per_torque = 0.0, per_speed = 0.0, per_load = 0.0;
};

struct GearFriction {
  double coulomb = 0.0;             // Fc, N m
  double stribeck = 0.0;            // Fs, N m
  double motor = 0.0;               // Km, -
  double load = 0.0;                // Ke, -
  double motor_stribeck = 0.0;      // Kms, -
  double load_stribeck = 0.0;       // Kes, -
  double motor_quadratic = 0.0;     // Qm, 1/(N m)
  double load_quadratic = 0.0;      // Qe, 1/(N m)
  double stribeck_speed = 1.0;      // ws, rad/s
  double stribeck_exponent = 1.0;   // a, -
  double viscous = 0.0;             // of the gear, N m s/rad: it is part of the drive's damping
  bool external_load = false;       // the load is the external one

  bool present() const {
    return coulomb > 0.0 || stribeck > 0.0 || motor > 0.0 || load > 0.0 || motor_stribeck > 0.0 ||
           load_stribeck > 0.0 || motor_quadratic > 0.0 || load_quadratic > 0.0;
  }

  // Under a motor torque u along the motion [N m] at a speed w [rad/s]; at speeds below zero that of rest.
  GearResponse under_motor(double u, double w) const { return solve(u, w, true); }

  // Under a load e along the motion [N m], the negative of what is passed on.
  GearResponse under_load(double e, double w) const { return solve(e, w, false); }

  // Under a motor torque u and an external load e along the motion [N m].
  GearResponse under_both(double u, double e, double w) const {
    w = std::max(w, 0.0);
    const Stribeck s = stribeck_at(w);
    const Level now = level(u, e, s.factor);
    return {now.value, now.per_motor, s.slope * now.faded, now.per_load};
  }

  // F where the gear passes on p [N m] along the motion under an external load e: u = p + F + viscous w.
  double where_passed(double p, double e, double w) const {
    const double factor = stribeck_at(std::max(w, 0.0)).factor, drag = viscous * std::max(w, 0.0);
    double friction = coulomb;
    for (int step = 0; step < kMostSteps; ++step) {
      const Level now = level(p + friction + drag, e, factor);
      const double change = (now.value - friction) / (1.0 - now.per_motor);
      friction += change;
      if (!(std::abs(change) > kRoundOff * (std::abs(friction) + std::abs(p)))) break;
    }
    return friction;
  }

 private:
  static constexpr int kMostSteps = 50;       // of Newton; three to five are taken
  static constexpr double kRoundOff = 4e-16;  // relative change of F that ends them
  static constexpr double kBlend = 0.1;       // of |e| / |u| about 1, half the width of the passage
  static constexpr double kSteepest = 1e-3;   // part of ws below which the slope in the speed is that there

  struct Stribeck {
    double factor, slope;  // s [-] and ds/dw [s/rad]
  };
  Stribeck stribeck_at(double w) const {
    const double x = w / stribeck_speed;
    const double factor = std::exp(-std::pow(x, stribeck_exponent));
    const double steep = std::max(x, kSteepest);
    const double there = steep == x ? factor : std::exp(-std::pow(steep, stribeck_exponent));
    return {factor, -there * stribeck_exponent * std::pow(steep, stribeck_exponent - 1.0) / stribeck_speed};
  }

  // What the formula gives for u and e, and its slopes in both.
  struct Level {
    double value, per_motor, per_load, faded;  // N m, -, -, N m: the part that fades with the speed
  };
  Level level(double u, double e, double s) const {
    const double plain = load * e - motor * u, slow = load_stribeck * e - motor_stribeck * u;
    const double sign = plain < 0.0 ? -1.0 : 1.0, slow_sign = slow < 0.0 ? -1.0 : 1.0;
    const Quadratic square = u * e < 0.0 ? quadratic(u, e) : Quadratic();
    const double faded = stribeck + std::abs(slow) + square.value;
    return {coulomb + std::abs(plain) + s * faded,
            -sign * motor + s * (square.per_motor - slow_sign * motor_stribeck),
            sign * load + s * (square.per_load + slow_sign * load_stribeck), faded};
  }

  // Q where motor and load oppose each other. It jumps at |e| = |u|, where an external load may pass: there
  // one piece passes into the other by 3 p^2 - 2 p^3.
  struct Quadratic {
    double value = 0.0, per_motor = 0.0, per_load = 0.0;
  };
  Quadratic quadratic(double u, double e) const {
    const double by_load = load_quadratic * e * e, by_motor = motor_quadratic * u * u;
    const double ratio = std::abs(e) / std::abs(u);
    double p = ratio < 1.0 ? 0.0 : 1.0;
    if (external_load) p = std::clamp((ratio - 1.0 + kBlend) / (2.0 * kBlend), 0.0, 1.0);
    const double share = p * p * (3.0 - 2.0 * p), slope = 6.0 * p * (1.0 - p) / (2.0 * kBlend);
    // Slope by the ratio, times it; outside of the passage the ratio may overflow.
    const double turn = slope > 0.0 ? slope * (by_motor - by_load) * ratio : 0.0;
    return {(1.0 - share) * by_load + share * by_motor,
            2.0 * share * motor_quadratic * u - turn / u,
            2.0 * (1.0 - share) * load_quadratic * e + turn / e};
  }

  GearResponse solve(double given, double w, bool of_motor) const {
    w = std::max(w, 0.0);
    const Stribeck s = stribeck_at(w);
    const double drag = viscous * w;
    double friction = coulomb;
    Level now{};
    double slope = 1.0;  // of F - formula in F
    for (int step = 0; step < kMostSteps; ++step) {
      const double other = friction + drag - given;
      now = of_motor ? level(given, other, s.factor) : level(other, given, s.factor);
      slope = 1.0 - (of_motor ? now.per_load : now.per_motor);
      const double change = (now.value - friction) / slope;
      friction += change;
      if (!(std::abs(change) > kRoundOff * (std::abs(friction) + std::abs(given)))) break;
    }
    const double own = of_motor ? now.per_motor - now.per_load : now.per_load - now.per_motor;
    const double by_drag = of_motor ? now.per_load : now.per_motor;
    return {friction, own / slope, (s.slope * now.faded + by_drag * viscous) / slope};
  }
};

}  // namespace hexapod
