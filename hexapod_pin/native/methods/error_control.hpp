// Step sizes from error estimates, and where a step ends.
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

namespace hexapod {

// Largest error over the tolerance: positions (m, rad) and bristles (m) as they are, velocities times
// w = max(h, floor, 0.1 kt tol) seconds. The last keeps velocity errors below a tenth of the friction
// law's speed scale 1/kt; without it friction chatters. `steepness` is 0 for explicit methods.
struct ErrorNorm {
  double tolerance;  // m and rad
  double floor;      // s
  double steepness;  // kt, s/m

  double weight(double h) const {
    return std::max({h, floor, 0.1 * steepness * tolerance});
  }

  template <class Positions, class Velocities, class Bristles>
  double operator()(const Positions& x, const Velocities& v, const Bristles& z, double h) const {
    const double most = std::max(x.cwiseAbs().maxCoeff(), weight(h) * v.cwiseAbs().maxCoeff());
    const double all = z.size() > 0 ? std::max(most, z.cwiseAbs().maxCoeff()) : most;
    return all / tolerance;
  }
};

// Next step after an error of `size` tolerances.
inline double next_step(double h, double size, int order, bool accepted) {
  const double factor = size > 0.0 ? 0.9 * std::pow(size, -1.0 / order) : 5.0;  // 0 if size is inf
  return h * (accepted ? std::clamp(factor, 0.2, 5.0) : std::clamp(factor, 0.1, 0.8));
}

// A step towards the end of an interval: neither beyond it nor leaving a very short rest.
inline double fit_step(double h, double rest) {
  if (h >= rest) return rest;
  return h > 0.5 * rest ? 0.5 * rest : h;
}

}  // namespace hexapod
