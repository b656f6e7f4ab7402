// Loads that feet are to carry, and set-points and targets that allow for how servos and soles give way.
#pragma once

#include <algorithm>
#include <cmath>

#include "control/control_memory.hpp"
#include "control/foot_control_settings.hpp"
#include "control/foot_sense.hpp"
#include "control/force_targets.hpp"
#include "control/walk_table.hpp"

namespace hexapod {

class Anticipation {
 public:
  explicit Anticipation(const FootControlSettings& settings) : set_(settings) {}

  // Weights of the feet and the forces that they are to carry at the time of the plan. A foot takes up its
  // part, and gives it back, about the times of the plan; one that finds no ground has none, one that finds it
  // early has it at once.
  void expect(const WalkPlan& plan, const Felt& felt, ControlMemory& m) const {
    const double keep = m.begun > 0.0 ? set_.upright_time / (set_.upright_time + set_.period) : 0.0;
    m.upright = (keep * m.upright - (1.0 - keep) * felt.down).normalized();
    const double step = 2.0 * set_.period / set_.load_time;
    LegNumbers share;
    for (int l = 0; l < kLegs; ++l) {
      LegMemory& leg = m.leg[l];
      const double wanted = leg.phase.mode == LegMode::search  ? 0.0
                            : leg.phase.mode == LegMode::early ? 1.0
                                                               : planned_share(plan[l]);
      leg.share = share[l] = std::clamp(wanted, leg.share - step, leg.share + step);
    }
    const LegVectors force =
        set_.targets ? force_targets(set_.least_torque, felt.statics, share, set_.weight, m.upright, felt.up)
                     : vertical_forces(felt.statics, share, set_.weight, m.upright);
    for (int l = 0; l < kLegs; ++l) m.leg[l].target = force[l];
  }

  // Offset of a leg's set-points [rad] and its rate [rad/s] with which its servos give the torques own -
  // J^T force: kp d + kd d' = torque, for torques that are straight from tick to tick.
  void offset(const Felt& felt, int l, bool begun, LegMemory& leg, LegTarget& out) const {
    if (!set_.anticipates) return;
    const LegStatics& at = felt.statics[l];
    const Vec3 torque = at.own - at.jacobian.transpose() * leg.target;
    const Vec3 wanted = set_.give[l].cwiseProduct(torque), before = begun ? leg.wanted : wanted;
    const Vec3 slope = (wanted - before) / set_.period;
    for (int k = 0; k < 3; ++k) {
      const double lag = set_.lag[l][k], last = begun ? leg.servo_offset[k] : wanted[k];
      const double after = lag > 0.0 ? wanted[k] - lag * slope[k] +
                                           (last - before[k] + lag * slope[k]) * std::exp(-set_.period / lag)
                                     : wanted[k];
      out.offset_rate[k] = lag > 0.0 ? (wanted[k] - after) / lag : slope[k];
      out.offset[k] = leg.servo_offset[k] = after;
    }
    leg.wanted = wanted;
  }

  // How far the target of a foot goes into the ground for the deflection of its sole, m.
  Vec3 sole(const Felt& felt, const LegMemory& leg) const {
    if (!(set_.sole_stiffness > 0.0)) return Vec3::Zero();
    const double normal = leg.target.dot(felt.up);
    const double depth = std::pow(std::max(0.0, normal) / set_.sole_stiffness, 1.0 / set_.sole_exponent);
    return -depth * felt.up - set_.sole_give * (leg.target - normal * felt.up);
  }

 private:
  double ramp(double after) const {
    return swing_share(std::clamp(0.5 + after / set_.load_time, 0.0, 1.0));
  }

  double planned_share(const LegPlan& plan) const {
    return plan.down ? std::min(ramp(plan.since_down), ramp(plan.until_lift))
                     : std::max(ramp(-plan.since_lift), ramp(-plan.until_down));
  }

  FootControlSettings set_;
};

}  // namespace hexapod
