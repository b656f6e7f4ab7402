// S1's correction of the feet along the ground: a PID on what drives the trunk nowhere, or on how far feet
// have slid against each other.
#pragma once

#include <algorithm>

#include "control/control_memory.hpp"
#include "control/foot_control_settings.hpp"
#include "control/foot_sense.hpp"
#include "control/stance_forces.hpp"

namespace hexapod {

class SlipCorrection {
 public:
  explicit SlipCorrection(const FootControlSettings& settings) : set_(settings) {}

  void step(const Felt& felt, ControlMemory& m) const {
    if (set_.signal == SlipSignal::none) return;
    LegNumbers load;
    LegVectors tangential;
    for (int l = 0; l < kLegs; ++l) {
      const LegMemory& leg = m.leg[l];
      const double normal = leg.force.dot(felt.up);
      const bool carries = !set_.targets || leg.share > kSmallShare;
      load[l] = leg.phase.on_ground() && carries && normal > set_.threshold ? normal : 0.0;
      tangential[l] = leg.force - normal * felt.up;
      if (set_.targets) tangential[l] -= aimed_at(tangential[l], normal, leg.target, felt.up);
    }
    const LegVectors error = set_.signal == SlipSignal::force
                                 ? internal_forces(felt.foot, tangential, load, felt.up)
                                 : against_slip(felt, load, m);
    for (int l = 0; l < kLegs; ++l)
      if (load[l] > 0.0)
        m.leg[l].correction = slip_correction(set_.slip, set_.period, error[l], m.leg[l].pid);
  }

  // At lift-off the correction stays in the offset, from which the swing takes it back.
  static void end(LegMemory& leg) {
    leg.phase.offset += leg.correction;
    leg.correction.setZero(), leg.slid.setZero();
    leg.pid = SlipMemory();
  }

 private:
  static constexpr double kMostLoad = 1.5;  // of the target's: so far does its tangential force go with the load

  // The tangential force that a foot of this load may have: the target's in proportion to the load, or what is
  // nearest to its own between that and none.
  Vec3 aimed_at(const Vec3& tangential, double normal, const Vec3& target, const Vec3& up) const {
    const double planned = target.dot(up);
    if (!(planned > 0.0)) return Vec3::Zero();
    const Vec3 most = std::clamp(normal / planned, 0.0, kMostLoad) * (target - planned * up);
    const double square = most.squaredNorm();
    if (!set_.one_sided || !(square > 0.0)) return most;
    return std::clamp(tangential.dot(most) / square, 0.0, 1.0) * most;
  }

  // How far feet have slid on the ground since touch-down, the trunk's own motion taken out; negative, as
  // the correction goes against it, m.
  LegVectors against_slip(const Felt& felt, const LegNumbers& load, ControlMemory& m) const {
    const PlanarMotion common = common_motion(felt.foot, felt.moved, load, felt.up);
    LegVectors out;
    for (int l = 0; l < kLegs; ++l) {
      LegMemory& leg = m.leg[l];
      if (load[l] > 0.0) leg.slid += felt.moved[l] - common.at(felt.foot[l], felt.up);
      leg.slid -= felt.up * felt.up.dot(leg.slid);
      out[l] = -leg.slid;
    }
    return out;
  }

  FootControlSettings set_;
};

}  // namespace hexapod
