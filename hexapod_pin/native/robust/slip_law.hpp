// The friction law of one contact over a step: the impulse m(s) at end slip speed s under a normal
// impulse. A bristle is the law min(gain s, bound) of a slip shifted by its stretch.
#pragma once

#include <algorithm>

#include "laws/friction_response.hpp"

namespace hexapod {

class SlipLaw {
 public:
  SlipLaw() = default;
  SlipLaw(const FrictionLaw& law, double mu_scale, bool sliding, double h, double weight)
      : law_(&law), scale_(mu_scale), bristle_(law.has_bristle()) {
    mu_ = mu_scale * (bristle_ ? law.coefficient(sliding) : law.largest_coefficient());
    gain_ = bristle_ ? weight * law.bristle_gain(h) : 0.0;
    largest_ratio_ = bristle_ ? 0.0 : mu_scale * law.largest_ratio();
  }

  bool none() const { return law_->kind == FrictionKind::none; }
  double bound(double normal) const { return mu_ * normal; }  // of m, N s
  double largest_ratio(double normal) const {                 // of m/s, N s/(m/s)
    return bristle_ ? gain_ : largest_ratio_ * normal;
  }
  double width(double normal) const {  // slip speed at which the law saturates, m/s
    return bound(normal) / std::max(largest_ratio(normal), kTiny);
  }

  // Whether a bristle is at its bound.
  bool slides(double speed, double normal) const { return gain_ * speed > mu_ * normal; }

  FrictionResponse operator()(double speed, double normal) const {
    return bristle_ ? bristle_response(gain_, mu_, speed, normal)
                    : sliding_response(*law_, scale_, speed, normal);
  }

 private:
  static constexpr double kTiny = 1e-300;  // N s/(m/s), against a division by zero

  const FrictionLaw* law_ = nullptr;
  double scale_ = 1.0;
  bool bristle_ = false;
  double mu_ = 0.0, gain_ = 0.0, largest_ratio_ = 0.0;
};

}  // namespace hexapod
