// Foot control after S1: the planned feet, moved by what they feel. One row is one robot; a row's answer
// depends on that row alone.
#pragma once

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "control/anticipation.hpp"
#include "control/control_memory.hpp"
#include "control/foot_control_settings.hpp"
#include "control/foot_sense.hpp"
#include "control/leg_phase.hpp"
#include "control/load_bearing.hpp"
#include "control/slip_correction.hpp"
#include "control/trunk_posture.hpp"
#include "control/walk_table.hpp"

namespace hexapod {

class FootControlLaw {
 public:
  FootControlLaw(const FootControlSettings& settings, std::vector<LegChain> legs,
                 std::vector<std::array<std::size_t, 3>> joints, std::vector<std::size_t> feet)
      : lead_(settings.lead), period_(settings.period), reflex_(settings.touch_down, settings.period),
        expected_(settings), loads_(settings), slip_(settings), posture_(settings),
        sense_(settings, std::move(legs), std::move(joints), std::move(feet)) {}

  bool fits(std::size_t joints, std::size_t feet) const { return sense_.fits(joints, feet); }

  // What the feet are to do at the end of the tick's command, and the memory after it.
  void update(const WalkTable& table, double time, const Readings& in, ControlMemory& m, LegTargets& out) const {
    const double now = time + lead_ - m.lag;
    const WalkPlan plan = at_pace(table.at(now), m.pace);
    const Felt felt = sense_.read(in, m);
    posture_.level(felt, m);
    for (int l = 0; l < kLegs; ++l) {
      LegMemory& leg = m.leg[l];
      if (leaves(plan[l], leg.phase)) SlipCorrection::end(leg);
      const Vec3 ground = m.pace * table.ground_velocity(now, plan[l].foot + leg.phase.offset);
      reflex_.step(plan[l], {leg.force, felt.touches[l], felt.free[l], felt.up}, ground, leg.phase);
    }
    posture_.keep_time(plan, m);
    posture_.follow_ground(plan, m);
    const bool begun = m.begun > 0.0;
    if (!begun) expected_.expect(plan, felt, m);
    slip_.step(felt, m);
    loads_.yield_to_loads(plan, felt, m);
    expected_.expect(plan, felt, m);
    for (int l = 0; l < kLegs; ++l) {
      LegMemory& leg = m.leg[l];
      Vec3 displaced = leg.phase.offset + leg.correction + leg.suspension.travel * felt.up;
      displaced.z() += m.pitch * plan[l].foot.x() + m.roll * plan[l].foot.y();
      displaced += expected_.sole(felt, leg);
      expected_.offset(felt, l, begun, leg, out[l]);
      out[l].foot = plan[l].foot + displaced;
      out[l].rate = plan[l].velocity;
      if (begun) out[l].rate += (displaced - leg.displaced) / period_;
      leg.displaced = displaced;
    }
    m.begun = 1.0;
  }

  // Set-points and rates of the joints at the end of the command; `q` holds the angles that put the feet on
  // their targets.
  void set_points(const LegTargets& targets, double* q, double* v) const { sense_.set_points(targets, q, v); }

 private:
  static WalkPlan at_pace(WalkPlan plan, double pace) {
    for (LegPlan& leg : plan) leg.velocity *= pace;
    return plan;
  }

  static bool leaves(const LegPlan& plan, const LegPhase& leg) {
    return !plan.down && (leg.mode == LegMode::down || leg.mode == LegMode::search);
  }

  double lead_, period_;  // s
  LegReflex reflex_;
  Anticipation expected_;
  LoadBearing loads_;
  SlipCorrection slip_;
  TrunkPosture posture_;
  FootSense sense_;
};

}  // namespace hexapod
