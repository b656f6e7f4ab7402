// A mass on a spring and a damper between leg and foot: m z'' + c z' + k z = load, z the retraction.
#pragma once

#include <algorithm>

namespace hexapod {

struct SuspensionGains {
  double mass = 0.0, damping = 0.0, stiffness = 0.0;  // kg, N s/m, N/m
  double limit = 0.0;                                 // largest travel either way, m
};

struct SuspensionState {
  double travel = 0.0, rate = 0.0;  // m, m/s
};

// One tick by the implicit Euler rule; `load` is the normal force less the nominal one, N. At its limit
// the suspension rests against a stop.
inline void yield(const SuspensionGains& gains, double period, double load, SuspensionState& state) {
  const double spring = gains.stiffness * (state.travel + period * state.rate);
  const double push = period * (load - gains.damping * state.rate - spring);
  state.rate += push / (gains.mass + period * gains.damping + period * period * gains.stiffness);
  const double travel = state.travel + period * state.rate;
  state.travel = std::clamp(travel, -gains.limit, gains.limit);
  if (travel != state.travel) state.rate = 0.0;
}

}  // namespace hexapod
