// The normal impulse of one contact over a step, as a decreasing function of x = its end velocity
// along the normal: the contact moves from depth d0 to d0 - h x on a straight path.
#pragma once

#include <algorithm>
#include <cmath>

#include "laws/normal.hpp"

namespace hexapod {

struct NormalImpulse {
  double impulse = 0.0;  // weight * N, N s
  double slope = 0.0;    // -d impulse/dx, N s/(m/s), never negative
};

// Hunt-Crossley and restitution laws: the elastic force is its mean along the path, so that touch-down
// and lift-off inside the step get their share and elastic work is exact. Kelvin-Voigt and IMPACT: the
// force at the end of the step; Kelvin-Voigt's damper acts for the part of the path in the ground, or
// it would jump at touch-down.
class NormalStep {
 public:
  NormalStep() = default;
  NormalStep(const NormalLaw& law, double k_scale, double touch_speed, double depth, double h,
             double weight)
      : law_(&law), mean_(law.damping_follows_spring()), scale_(weight * k_scale), depth_(depth),
        h_(h) {
    if (!mean_) return;
    gain_ = law.damping_gain(touch_speed);
    energy_ = law.energy(depth);
  }

  NormalImpulse operator()(double x) const { return mean_ ? mean_over_path(x) : at_end(x); }

  double depth_at(double x) const { return depth_ - h_ * x; }
  double deepest(double x) const { return std::max(depth_, depth_at(x)); }

  // End velocity at and above which the force vanishes, m/s.
  double separation_velocity() const {
    if (!mean_ || depth_ <= 0.0) return depth_ / h_;
    return gain_ > 0.0 ? 1.0 / gain_ : kUnbounded;
  }

  // A first guess below separation_velocity() for the root of x = a + g impulse(x).
  double guess(double a, double g) const {
    if (mean_ && depth_ > 0.0) return a;
    const double above = depth_ / h_ - a;
    double end = h_ * above;
    if (g > 0.0) end = std::min(end, law_->depth_of(above / (g * scale_ * law_->stiffness)));
    return (depth_ - end) / h_;
  }

 private:
  static constexpr double kUnbounded = 1e5;   // m/s, above any velocity of a robot
  static constexpr double kShortPath = 1e-3;  // of the depth: the force at its middle is its mean

  NormalImpulse mean_over_path(double x) const {
    const double factor = 1.0 - gain_ * x, end = depth_at(x);
    if (factor <= 0.0 || (end <= 0.0 && depth_ <= 0.0)) return {};
    double force, slope;  // elastic, and its derivative to x
    if (depth_ > 0.0 && std::abs(h_ * x) < kShortPath * depth_) {
      const double middle = 0.5 * (depth_ + end);
      force = law_->spring(middle);
      slope = -0.5 * h_ * law_->spring_slope(force, middle);
    } else {
      const double last = law_->spring(end);
      force = (energy_ - law_->spring_energy(last, std::max(end, 0.0))) / (h_ * x);
      slope = (last - force) / x;
    }
    return {scale_ * factor * force, scale_ * (gain_ * force - factor * slope)};
  }

  NormalImpulse at_end(double x) const {
    const double end = depth_at(x);
    const bool voigt = law_->kind == NormalKind::kelvin_voigt;
    const NormalForce f = (*law_)(end, voigt ? std::min(-x, end / h_) : -x);
    if (f.force <= 0.0) return {};
    const double slope = h_ * f.d_depth + f.d_rate;  // IMPACT's damper may fall with depth
    return {scale_ * f.force,
            scale_ * (slope > 0.0 ? slope : law_->spring_slope(f.elastic, end, h_))};
  }

  const NormalLaw* law_ = nullptr;
  bool mean_ = true;
  double scale_ = 0.0, depth_ = 0.0, h_ = 1.0, gain_ = 0.0, energy_ = 0.0;
};

}  // namespace hexapod
