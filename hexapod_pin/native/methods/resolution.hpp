// How finely an adaptive method resolves a run. Global errors are found by comparing two runs of which one
// is finer in all that limits its steps: a looser tolerance alone leaves those steps as they are that end
// at samples, or that the friction law's speed scale limits. Steps of runs that are compared end at samples
// on purpose: two of them with steps as long as their tolerances allow differ by more than is requested,
// and need a third.
#pragma once

#include <algorithm>
#include <cmath>

namespace hexapod {

struct Resolution {
  double tolerance = 0.0;   // of one step, before the method's own share, m and rad
  double refinement = 1.0;  // of velocities across friction and of steps between samples, at least 1
  double sample = 0.0;      // time between samples, s
  bool dense = false;       // steps pass over samples, where the method knows the states within them

  // The longest step of what is left to a stop: equal parts, of a sampling interval as many as an order
  // of 3 needs for errors that are `refinement` times smaller.
  double longest_step(double rest) const {
    if (refinement <= 1.0) return rest;
    const double parts = std::ceil(std::cbrt(refinement) - 1e-9);
    return rest / std::max(1.0, std::ceil(parts * rest / sample - 1e-6));
  }
};

}  // namespace hexapod
