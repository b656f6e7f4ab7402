// Numbers of foot control; the Python classes that set them document them.
#pragma once

#include <array>

#include "control/force_targets.hpp"
#include "control/leg_phase.hpp"
#include "control/slip_pid.hpp"
#include "control/virtual_suspension.hpp"
#include "control/walk_table.hpp"

namespace hexapod {

enum class ForceSource { foot, torque, current };
enum class SlipSignal { none, force, slip };

struct FootControlSettings {
  double period = 0.005;  // s
  double lead = 0.005;    // from a tick until its command has arrived, s

  ForceSource source = ForceSource::foot;
  double filter_time = 0.0;  // of the forces, s
  double threshold = 1.0;    // force of a foot that touches, N

  std::array<double, kLegs> radius = {};  // of the feet, m
  std::array<Vec3, kLegs> lower = {}, upper = {}, max_rate = {};  // of the joints, rad, rad, rad/s

  SlipSignal signal = SlipSignal::none;
  SlipGains slip;
  bool anticipates = false;  // whether commands allow for how servos give way to the loads of the feet
  std::array<Vec3, kLegs> give = {};  // of the servos, 1 / kp, rad/(N m)
  std::array<Vec3, kLegs> lag = {};   // of the servos, kd / kp, s

  bool targets = false;  // whether these loads are of least torque; else vertical
  bool one_sided = true;  // whether slip correction leaves forces between none and their targets
  LeastTorque least_torque;
  double upright_time = 0.0;  // of the filter of the direction of gravity, s
  double sole_stiffness = 0.0, sole_exponent = 1.0;  // force = stiffness depth^exponent, N/m^exponent, -
  double sole_give = 0.0;  // along the ground, m/N; stiffness 0: soles are not allowed for

  bool suspended = false;
  SuspensionGains suspension;
  double heave = 1.0, tilt = 1.0, warp = 1.0;  // shares of the loads' errors that legs yield to, -
  double nominal_load = 0.0;  // of a standing foot, N; 0: its part of the weight
  double load_time = 0.05;    // in which a foot takes up its part, and gives it back, s
  double weight = 0.0;        // N
  double gravity = 9.81;      // m/s^2
  Vec3 trunk_moment = Vec3::Zero();  // mass times centre of all that is no leg, trunk frame, kg m

  TouchDownSettings touch_down;
  double follow_height = 0.0, follow_tilt = 0.0;  // rates at which the trunk follows the ground, 1/s
  double level_rate = 0.0;                        // of levelling, 1/s
  double level_limit = 0.0;                       // of the tilt between feet and trunk, rad
};

}  // namespace hexapod
