// How the trunk stands over its feet, and when the walk waits for them.
#pragma once

#include <algorithm>
#include <cmath>

#include "control/control_memory.hpp"
#include "control/foot_control_settings.hpp"
#include "control/foot_sense.hpp"
#include "control/stance_forces.hpp"
#include "control/walk_table.hpp"

namespace hexapod {

class TrunkPosture {
 public:
  explicit TrunkPosture(const FootControlSettings& settings) : set_(settings) {}

  // Tilts the plane of the feet until the trunk is level.
  void level(const Felt& felt, ControlMemory& m) const {
    const double step = set_.period * set_.level_rate;
    if (step == 0.0) return;
    const double most = std::tan(set_.level_limit);
    m.roll = std::clamp(m.roll + step * felt.roll, -most, most);
    m.pitch = std::clamp(m.pitch - step * felt.pitch, -most, most);
  }

  // The trunk follows the ground under its feet: height and slope of their offsets go to 0.
  void follow_ground(const WalkPlan& plan, ControlMemory& m) const {
    if (!set_.touch_down.reacts) return;
    LegVectors place;
    LegNumbers standing;
    for (int l = 0; l < kLegs; ++l) {
      place[l] = Vec3(plan[l].foot.x(), plan[l].foot.y(), m.leg[l].phase.offset.z());
      standing[l] = m.leg[l].phase.on_ground() ? 1.0 : 0.0;
    }
    const Vec3 plane = fitted_plane(place, standing);
    const double a = set_.period * set_.follow_height, b = set_.period * set_.follow_tilt;
    for (int l = 0; l < kLegs; ++l) {
      const double down = a * plane[0] + b * (plane[1] * place[l].x() + plane[2] * place[l].y());
      m.leg[l].phase.offset.z() -= down, m.leg[l].phase.left_with.z() -= down;
    }
  }

  // The plan's clock stands while a foot that should be down looks for the ground: none lifts off before.
  void keep_time(const WalkPlan& plan, ControlMemory& m) const {
    const double patience = set_.touch_down.patience;
    bool waits = false;
    for (int l = 0; l < kLegs; ++l) {
      const LegPhase& leg = m.leg[l].phase;
      waits = waits || (leg.mode == LegMode::search && leg.searched < patience && plan[l].since_down < patience);
    }
    const double step = set_.period / kPaceTime;
    m.pace = std::clamp(waits ? 0.0 : 1.0, m.pace - step, m.pace + step);
    m.lag += set_.period * (1.0 - m.pace);
  }

 private:
  static constexpr double kPaceTime = 0.02;  // in which the plan's clock stops or starts, s

  FootControlSettings set_;
};

}  // namespace hexapod
