// Where within a step a contact stops pressing, because its damper would pull, or begins to press again:
// the sign of its normal force along the step.
#pragma once

#include <algorithm>
#include <cmath>

#include "laws/normal.hpp"

namespace hexapod {

// A contact at the start or the end of a step: gap [m], and the rate at which its foot leaves, along the
// normal [m/s]. On curved ground that is not the rate of the gap: both are taken as straight lines.
struct GapState {
  double gap = 0.0, rate = 0.0;
};

struct Release {
  double share = 1.0;  // of the step, at which the sign changes; 1: nowhere
  double force = 0.0;  // N, the most behind it that the frozen piece of the law is wrong by
};

// The first change of a contact that is in the ground at the start of the step.
inline Release find_release(const NormalLaw& law, double touch_speed, bool released, const GapState& start,
                            const GapState& end) {
  constexpr int kPoints = 12, kNearSurface = 12;
  const auto force = [&](double gap, double rate) {
    return law(-gap, -rate, touch_speed, NormalPiece::pressing).force;
  };
  const auto wrong = [&](double s) {  // N; not positive: in its piece
    const double gap = start.gap + s * (end.gap - start.gap);
    const double pressing = force(gap, start.rate + s * (end.rate - start.rate));
    return gap < 0.0 ? (released ? pressing : -pressing) : 0.0;
  };
  Release found;
  const double fastest = std::max(start.rate, end.rate);
  if (!released && force(start.gap, fastest) > 0.0 && force(end.gap, fastest) > 0.0) return found;
  double before = 0.0;
  const auto look = [&](double s) {
    const double now = wrong(s);
    found.force = std::max(found.force, now);
    if (now > 0.0 && found.share == 1.0) {
      double low = before, high = s;
      for (int i = 0; i < 40; ++i) {
        const double middle = 0.5 * (low + high);
        (wrong(middle) > 0.0 ? high : low) = middle;
      }
      found.share = high;
    }
    before = s;
  };
  for (int k = 0; k <= kPoints; ++k) look(double(k) / kPoints);
  // Just below the surface a damper that fades with depth is weaker than the spring: there a contact presses
  // once more before it ends, in depths that are small beside those of the step.
  before = 0.0;
  double gap = start.gap;
  for (int k = 0; k < kNearSurface && gap < end.gap; ++k) {
    look((start.gap - gap) / (start.gap - end.gap));
    gap *= 0.25;
  }
  return found;
}

}  // namespace hexapod
