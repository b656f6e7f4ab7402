// The normal impulse of one contact over a step, as a decreasing function of x = its end velocity
// along the normal: the contact moves from depth d0 to d0 - h x on a straight path.
#pragma once

#include <algorithm>
#include <cmath>

#include "laws/normal.hpp"

namespace hexapod {

struct Push {
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
      : law_(&law), scale_(weight * k_scale), depth_(depth), h_(h) {
    mean_ = law.kind == NormalKind::hunt_crossley || law.kind == NormalKind::restitution;
    if (!mean_) return;
    gain_ = law.kind == NormalKind::hunt_crossley
                ? 1.5 * law.dissipation
                : law.eta / std::max(touch_speed, law.speed_floor);
    energy_ = law.energy(depth);
  }

  Push operator()(double x) const { return mean_ ? mean_over_path(x) : at_end(x); }

  double depth_at(double x) const { return depth_ - h_ * x; }
  double deepest(double x) const { return std::max(depth_, depth_at(x)); }

  // the force vanishes here and above
  double most() const {
    if (!mean_ || depth_ <= 0.0) return depth_ / h_;
    return gain_ > 0.0 ? 1.0 / gain_ : kFast;
  }

  // A first guess below most() for the root of x = a + g impulse(x).
  double guess(double a, double g) const {
    if (mean_ && depth_ > 0.0) return a;
    const double above = depth_ / h_ - a;
    double end = h_ * above;
    if (g > 0.0)
      end = std::min(end, std::pow(above / (g * scale_ * law_->stiffness), 1.0 / law_->exponent));
    return (depth_ - end) / h_;
  }

 private:
  static constexpr double kFast = 1e5;  // m/s

  Push mean_over_path(double x) const {
    const double factor = 1.0 - gain_ * x, end = depth_at(x);
    if (factor <= 0.0 || (end <= 0.0 && depth_ <= 0.0)) return {};
    double force, slope;  // elastic, and its derivative to x
    if (depth_ > 0.0 && std::abs(h_ * x) < 1e-3 * depth_) {
      const NormalForce middle = elastic(0.5 * (depth_ + end));
      force = middle.elastic;
      slope = -0.5 * h_ * middle.d_depth;
    } else {
      const double last = elastic(end).elastic;
      force = (energy_ - last * std::max(end, 0.0) / (law_->exponent + 1.0)) / (h_ * x);
      slope = (last - force) / x;
    }
    return {scale_ * factor * force, scale_ * (gain_ * force - factor * slope)};
  }

  Push at_end(double x) const {
    const double end = depth_at(x);
    const bool voigt = law_->kind == NormalKind::kelvin_voigt;
    const NormalForce f = (*law_)(end, voigt ? std::min(-x, end / h_) : -x);
    if (f.force <= 0.0) return {};
    const double slope = h_ * f.d_depth + f.d_rate;  // IMPACT's damper may fall with depth
    return {scale_ * f.force, scale_ * (slope > 0.0 ? slope : h_ * law_->exponent * f.elastic / end)};
  }

  NormalForce elastic(double depth) const {
    if (depth <= 0.0) return {};
    NormalForce f;
    const double n = law_->exponent;
    f.elastic = law_->stiffness * (n == 1.5 ? depth * std::sqrt(depth)
                                   : n == 1.0 ? depth : std::pow(depth, n));
    f.d_depth = n * f.elastic / depth;
    return f;
  }

  const NormalLaw* law_ = nullptr;
  bool mean_ = true;
  double scale_ = 0.0, depth_ = 0.0, h_ = 1.0, gain_ = 0.0, energy_ = 0.0;
};

}  // namespace hexapod
