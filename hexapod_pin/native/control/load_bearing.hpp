// Virtual suspension: legs yield to what they bear beyond their loads, and reach for what they lack.
#pragma once

#include <algorithm>
#include <array>

#include "control/control_memory.hpp"
#include "control/foot_control_settings.hpp"
#include "control/foot_sense.hpp"
#include "control/force_targets.hpp"
#include "control/stance_forces.hpp"
#include "control/walk_table.hpp"

namespace hexapod {

class LoadBearing {
 public:
  explicit LoadBearing(const FootControlSettings& settings) : set_(settings) {}

  // Targets and weights are those that the last tick has found for this one's forces.
  void yield_to_loads(const WalkPlan& plan, const Felt& felt, ControlMemory& m) const {
    if (!set_.suspended) return;
    LegNumbers error, weight;
    for (int l = 0; l < kLegs; ++l) {
      const LegMemory& leg = m.leg[l];
      const double normal = felt.touches[l] ? std::max(0.0, leg.force.dot(felt.up)) : 0.0;
      const double load = set_.nominal_load > 0.0 ? leg.share * set_.nominal_load : leg.target.dot(felt.up);
      const bool late = plan[l].down && plan[l].since_down > kReachesAfter;
      error[l] = felt.touches[l] || late ? normal - load : 0.0;
      if (leg.share < kReachingShare) error[l] = std::max(0.0, error[l]);
      weight[l] = felt.touches[l] ? 1.0 : leg.share;
    }
    const LegNumbers load = by_modes(felt, error, weight);
    for (int l = 0; l < kLegs; ++l) yield(set_.suspension, set_.period, load[l], m.leg[l].suspension);
  }

 private:
  static constexpr double kReachesAfter = 0.1;   // its touch-down a foot without ground reaches for it, s
  static constexpr double kReachingShare = 0.5;  // a foot of smaller weight yields, and does not reach

  // Errors as heave, the same for all feet; tilt, which has their moment; warp, the rest: heave, tilt and
  // warp times their gains.
  LegNumbers by_modes(const Felt& felt, const LegNumbers& error, const LegNumbers& weight) const {
    if (set_.heave == set_.tilt && set_.tilt == set_.warp && set_.warp == 1.0) return error;
    std::array<Vec3, kLegs> row;
    Mat3 balance = Mat3::Zero();
    Vec3 sum = Vec3::Zero();
    for (int l = 0; l < kLegs; ++l) {
      row[l] = Vec3(1.0, felt.statics[l].arm.x(), felt.statics[l].arm.y());
      balance += weight[l] * row[l] * row[l].transpose();
      sum += error[l] * row[l];
    }
    if (!(balance(0, 0) > 0.0)) return error;
    const double all = balance(0, 0);
    constexpr double kLine = 1e-5;  // m^2: feet nearer to one line than 3 mm have no tilt
    const Vec3 plane = solved_damped(balance, kLine * all, sum);
    LegNumbers out;
    for (int l = 0; l < kLegs; ++l) {
      const double rigid = weight[l] * row[l].dot(plane), heave = weight[l] * sum[0] / all;
      out[l] = set_.heave * heave + set_.tilt * (rigid - heave) + set_.warp * (error[l] - rigid);
    }
    return out;
  }

  FootControlSettings set_;
};

}  // namespace hexapod
