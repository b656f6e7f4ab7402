// What standing feet ought to bear, and how their legs yield to what they bear.
#pragma once

#include <algorithm>

#include "control/control_memory.hpp"
#include "control/foot_control_settings.hpp"
#include "control/foot_sense.hpp"
#include "control/stance_forces.hpp"
#include "control/walk_table.hpp"

namespace hexapod {

class LoadBearing {
 public:
  explicit LoadBearing(const FootControlSettings& settings) : set_(settings) {}

  // Loads that are expected of the feet along the normal, N. A foot takes up its part, and gives it back,
  // about the times of the plan; one that finds no ground has none, one that finds it early has it at once.
  LegNumbers expected(const WalkPlan& plan, const Felt& felt, ControlMemory& m) const {
    const double step = 2.0 * set_.period / set_.load_time;
    for (int l = 0; l < kLegs; ++l) {
      LegMemory& leg = m.leg[l];
      const double wanted = leg.phase.mode == LegMode::search  ? 0.0
                            : leg.phase.mode == LegMode::early ? 1.0
                                                               : planned_share(plan[l]);
      leg.share = std::clamp(wanted, leg.share - step, leg.share + step);
    }
    return split(plan, felt, m, &LegMemory::share);
  }

  // Virtual suspension: legs yield to what they bear beyond their part, and reach for what they lack.
  void yield_to_loads(const WalkPlan& plan, const Felt& felt, ControlMemory& m) const {
    if (!set_.suspended) return;
    for (int l = 0; l < kLegs; ++l) {
      LegMemory& leg = m.leg[l];
      const double most = plan[l].down ? std::clamp(plan[l].until_lift / set_.load_time, 0.0, 1.0)
                          : leg.phase.on_ground() ? 1.0
                                                  : 0.0;
      leg.bearing = std::min(leg.bearing + set_.period / set_.load_time, most);
    }
    const LegNumbers load = split(plan, felt, m, &LegMemory::bearing);
    for (int l = 0; l < kLegs; ++l) {
      const double normal = felt.touches[l] ? std::max(0.0, m.leg[l].force.dot(felt.up)) : 0.0;
      yield(set_.suspension, set_.period, normal - load[l], m.leg[l].suspension);
    }
  }

 private:
  static constexpr double kSteepest = -0.1;  // of gravity along the trunk's z axis, for a robot that stands

  double ramp(double after) const {
    return swing_share(std::clamp(0.5 + after / set_.load_time, 0.0, 1.0));
  }

  double planned_share(const LegPlan& plan) const {
    return plan.down ? std::min(ramp(plan.since_down), ramp(plan.until_lift))
                     : std::max(ramp(-plan.since_lift), ramp(-plan.until_down));
  }

  LegNumbers split(const WalkPlan& plan, const Felt& felt, const ControlMemory& m,
                   double LegMemory::*part) const {
    LegVectors place;
    LegNumbers share, load;
    double height = 0.0, all = 0.0;
    for (int l = 0; l < kLegs; ++l) {
      place[l] = plan[l].foot + m.leg[l].phase.offset;
      share[l] = m.leg[l].*part;
      height += share[l] * place[l].z(), all += share[l];
      load[l] = share[l] * set_.nominal_load;
    }
    if (set_.nominal_load > 0.0) return load;
    const double depth = (all > 0.0 ? height / all : 0.0) - set_.centre.z();
    const Vec3 under = set_.centre + felt.down * (depth / std::min(felt.down.z(), kSteepest));
    return weight_split(place, share, set_.weight * -felt.down.dot(felt.up), under.head<2>());
  }

  FootControlSettings set_;
};

}  // namespace hexapod
