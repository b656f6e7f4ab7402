// What foot control remembers from tick to tick, as a struct and as a row of numbers.
#pragma once

#include <array>
#include <cstddef>

#include "control/leg_phase.hpp"
#include "control/slip_pid.hpp"
#include "control/virtual_suspension.hpp"
#include "control/walk_table.hpp"

namespace hexapod {

struct LegMemory {
  LegPhase phase;
  SlipMemory pid;
  SuspensionState suspension;
  Vec3 force = Vec3::Zero();       // filtered, trunk axes, N
  Vec3 foot = Vec3::Zero();        // where it was measured, m
  Vec3 rates = Vec3::Zero();       // of its joints, rad/s
  Vec3 slid = Vec3::Zero();        // since touch-down, m
  Vec3 correction = Vec3::Zero();  // of its position, m
  Vec3 displaced = Vec3::Zero();   // of its target from the plan, m
  double share = 1.0;              // weight of the foot among those that carry the robot, 0 to 1
  Vec3 target = Vec3::Zero();      // the force that it is to carry, trunk axes, N
  Vec3 servo_offset = Vec3::Zero();  // of its joints, for the torques of that force, rad
  Vec3 wanted = Vec3::Zero();        // the same without the servos' lag, rad
};

struct ControlMemory {
  std::array<LegMemory, kLegs> leg;
  double pitch = 0.0, roll = 0.0;  // slopes of the feet's plane that level the trunk: dz/dx, dz/dy
  double begun = 0.0;
  double lag = 0.0, pace = 1.0;  // of the plan's clock behind time, s; its rate
  Vec3 upright = Vec3::UnitZ();  // against gravity, filtered, trunk axes
};

// Calls `visit` with every number, always in the same order.
template <class Visit>
void each_number(ControlMemory& m, Visit visit) {
  const auto vector = [&](Vec3& v) {
    for (int k = 0; k < 3; ++k) visit(v[k]);
  };
  visit(m.pitch), visit(m.roll), visit(m.begun), visit(m.lag), visit(m.pace);
  vector(m.upright);
  for (LegMemory& leg : m.leg) {
    auto mode = double(leg.phase.mode);
    visit(mode), leg.phase.mode = LegMode(int(mode));
    visit(leg.phase.without_load), visit(leg.phase.searched), visit(leg.phase.rise);
    for (Vec3* v : {&leg.phase.offset, &leg.phase.left_with, &leg.phase.lag}) vector(*v);
    for (Vec3* v : {&leg.pid.integral, &leg.pid.error, &leg.pid.slope}) vector(*v);
    visit(leg.pid.begun), visit(leg.suspension.travel), visit(leg.suspension.rate);
    for (Vec3* v : {&leg.force, &leg.foot, &leg.rates, &leg.slid, &leg.correction, &leg.displaced})
      vector(*v);
    visit(leg.share);
    for (Vec3* v : {&leg.target, &leg.servo_offset, &leg.wanted}) vector(*v);
  }
}

inline std::size_t memory_size() {
  ControlMemory memory;
  std::size_t count = 0;
  each_number(memory, [&](double&) { ++count; });
  return count;
}

}  // namespace hexapod
