// Where a switching function is zero within a step.
#pragma once

#include <cmath>

namespace hexapod {

// The end of an earlier, longer try of the same step: its length [s] and the function's value there.
struct EarlierTry {
  double step = 0.0, value = 0.0;
};

// Share of a step h [s] at which a function with these values at its start and end is zero: on the
// parabola through an earlier try too, if that was longer; else on the line.
inline double switch_root(double before, double after, double h, const EarlierTry& earlier) {
  if (!(before > 0.0)) return 0.0;
  const double linear = before / (before - after);
  if (!(earlier.step > h)) return linear;
  const double p = earlier.step / h, slope = after - before;
  const double c = ((earlier.value - before) / p - slope) / (p - 1.0), b = slope - c;
  const double inside = b * b - 4.0 * c * before;
  const double root = inside >= 0.0 ? 2.0 * before / (std::sqrt(inside) - b) : linear;
  return root > 0.0 && root < 1.0 ? root : linear;
}

}  // namespace hexapod
