// The drive of a joint: PD servo with a feed-forward torque, a motor that limits the torque by a cap and by
// a line in the joint's speed, viscous and dry friction, stops. Pure functions of one joint's state.
//   demand = kp (q_ref - q) + kd (v_ref - v) + torque_ref
//   motor  = demand, clamped to the lines +-line_torque - line_slope v, then to +-cap
//   joint  = motor - damping v - (friction + gear friction) sign(v) + stop
// `external` [N m] is what acts on a joint but motor, friction and inertial forces, stops included; it
// matters to gears whose friction depends on it, to no others.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "laws/gear_friction.hpp"
#include "laws/joint_stops.hpp"
#include "laws/vectors.hpp"

namespace hexapod {

constexpr double kLock = 1e30;  // kg m^2; a joint does not move with it added to its inertia

// Which piece of the motor's torque holds.
enum class LimitMode : signed char {
  lower_line = -2, lower_cap = -1, within = 0, upper_cap = 1, upper_line = 2
};

// Dry friction: absent, holding a joint at rest, or opposing its positive or negative rate.
enum class FrictionMode : signed char { none, stuck, forward, backward };

struct DriveMode {
  LimitMode limit = LimitMode::within;
  StopMode stop = StopMode::free;
  FrictionMode friction = FrictionMode::none;

  bool stuck() const { return friction == FrictionMode::stuck; }
  bool operator==(const DriveMode& other) const {
    return limit == other.limit && stop == other.stop && friction == other.friction;
  }
  bool operator!=(const DriveMode& other) const { return !(*this == other); }
};

// A torque [N m] and its negative slopes in the angle [N m/rad] and in the rate [N m s/rad].
struct DriveTorque {
  double torque = 0.0, stiffness = 0.0, damping = 0.0;
};

// One entry per joint. Of a joint that slides N stands for N m, and m for rad.
struct DriveLaw {
  VectorXd kp;           // N m/rad
  VectorXd kd;           // N m s/rad
  VectorXd cap;          // N m, may be infinite
  VectorXd line_torque;  // stall torque at the voltage given, N m; infinite: no line
  VectorXd line_slope;   // stall torque over no-load speed, N m s/rad; 0: no line
  VectorXd damping;      // viscous, of joint and motor, N m s/rad
  VectorXd friction;     // level of dry friction, N m; 0: none
  JointStops stops;
  std::vector<GearFriction> gear;  // of each joint, beside `friction`; empty: none

  // Relative excess over the limit [-] that a solve's round-off may leave.
  static constexpr double kLimitSlack = 1e-12;
  static constexpr int kSwitches = 7;

  int joints() const { return int(kp.size()); }
  bool dry() const {
    for (int j = 0; j < joints(); ++j)
      if (has_friction(j)) return true;
    return false;
  }
  bool has_gear(int joint) const { return !gear.empty() && gear[std::size_t(joint)].present(); }
  // Whether any joint's gear friction depends on the external load.
  bool needs_external() const {
    return std::any_of(gear.begin(), gear.end(),
                       [](const GearFriction& one) { return one.external_load && one.present(); });
  }
  bool has_friction(int joint) const { return friction[joint] > 0.0 || has_gear(joint); }

  // From now on the joint's drive gives no torque; its friction and its stops stay.
  void disable(int joint) {
    kp[joint] = kd[joint] = cap[joint] = line_slope[joint] = 0.0;
    line_torque[joint] = std::numeric_limits<double>::infinity();
  }

  // Whether a motor's torque-speed line limits any joint.
  bool has_lines() const { return line_slope.size() > 0 && line_slope.maxCoeff() > 0.0; }

  // PD torque before the limits, N m, for errors of angle [rad] and rate [rad/s].
  double demand(int joint, double error, double rate_error, double torque_ref) const {
    return kp[joint] * error + kd[joint] * rate_error + torque_ref;
  }

  // A demand after the joint has moved by `angle` [rad] and its rate by `rate` [rad/s].
  double demand_after(int joint, double demand, double angle, double rate) const {
    return demand - kp[joint] * angle - kd[joint] * rate;
  }

  double upper_line(int joint, double rate) const {
    return line_torque[joint] - line_slope[joint] * rate;
  }
  double lower_line(int joint, double rate) const {
    return -line_torque[joint] - line_slope[joint] * rate;
  }
  double on_line(int joint, double demand, double rate) const {
    return std::clamp(demand, lower_line(joint, rate), upper_line(joint, rate));
  }

  bool is_within(int joint, double demand, double rate) const {
    return std::abs(demand) <= cap[joint] && demand <= upper_line(joint, rate) &&
           demand >= lower_line(joint, rate);
  }

  double motor_torque(int joint, double demand, double rate) const {
    if (is_within(joint, demand, rate)) return demand;
    return std::clamp(on_line(joint, demand, rate), -cap[joint], cap[joint]);
  }

  // The piece that a demand is on; `within` for one that is not a number.
  LimitMode limit_mode(int joint, double demand, double rate, double slack = 0.0) const {
    if (is_within(joint, demand, rate)) return LimitMode::within;
    const double upper = upper_line(joint, rate), lower = lower_line(joint, rate);
    const double torque = std::clamp(demand, lower, upper), most = cap[joint] * (1.0 + slack);
    if (torque > most) return LimitMode::upper_cap;
    if (torque < -most) return LimitMode::lower_cap;
    const double excess = slack > 0.0 ? slack * line_torque[joint] : 0.0;
    if (demand > upper + excess) return LimitMode::upper_line;
    if (demand < lower - excess) return LimitMode::lower_line;
    return LimitMode::within;
  }

  // The motor's torque on a piece that is known, beyond its ends too.
  double torque_on(int joint, LimitMode mode, double demand, double rate) const {
    if (mode == LimitMode::within) return demand;
    switch (mode) {
      case LimitMode::upper_cap: return cap[joint];
      case LimitMode::lower_cap: return -cap[joint];
      case LimitMode::upper_line: return upper_line(joint, rate);
      case LimitMode::lower_line: return lower_line(joint, rate);
      case LimitMode::within: break;
    }
    return demand;
  }
  double stiffness_on(int joint, LimitMode mode) const {
    return mode == LimitMode::within ? kp[joint] : 0.0;
  }
  double damping_on(int joint, LimitMode mode) const {
    if (mode == LimitMode::within) return kd[joint];
    return mode == LimitMode::upper_line || mode == LimitMode::lower_line ? line_slope[joint] : 0.0;
  }

  // Of a joint that moves, under the motor's torque; 0 of one that is stuck, which takes what holds it.
  double dry_torque(int joint, FrictionMode mode, double motor, double rate, double external) const {
    const double sign = friction_sign(mode);
    if (sign == 0.0) return 0.0;
    return -sign * (friction[joint] + gear_response(joint, mode, motor, rate, external).friction);
  }

  // Of the gear of a joint that moves; nothing of one that is stuck. Slopes in the motor's torque, in the
  // rate and in the external load, counted along the motion:
  // d(dry torque) = -per_torque d(motor) - per_speed d(rate) - per_load d(external).
  GearResponse gear_response(int joint, FrictionMode mode, double motor, double rate, double external) const {
    if (!has_gear(joint) || mode == FrictionMode::none || mode == FrictionMode::stuck) return {};
    const double sign = friction_sign(mode);
    const GearFriction& own = gear[std::size_t(joint)];
    if (own.external_load) return own.under_both(sign * motor, sign * external, sign * rate);
    return own.under_motor(sign * motor, sign * rate);
  }

  // The most that friction holds of `holding` [N m] at rest: what it takes once the joint has broken loose.
  double holding_limit(int joint, double motor, double holding, double external) const {
    const FrictionMode mode = holding < 0.0 ? FrictionMode::backward : FrictionMode::forward;
    return friction[joint] + gear_response(joint, mode, motor, 0.0, external).friction;
  }

  // What viscous and dry friction take of the motor's torque at a rate; of dry friction at rest nothing.
  double resistance(int joint, double motor, double rate, double external) const {
    return damping[joint] * rate - dry_torque(joint, sliding(joint, rate), motor, rate, external);
  }

  // The same, given the torque [N m] that is left of the motor's after it.
  double resistance_to(int joint, double left, double rate, double external) const {
    const FrictionMode mode = sliding(joint, rate);
    const double plain = friction_sign(mode) * friction[joint];
    if (!has_gear(joint) || mode == FrictionMode::none || mode == FrictionMode::stuck)
      return damping[joint] * rate + plain;
    const GearFriction& own = gear[std::size_t(joint)];
    const double sign = friction_sign(mode);
    // what the gear passes on turns the joint against its own friction and damping, too
    const double passed = left + plain + (damping[joint] - own.viscous) * rate;
    const double taken = own.external_load ? own.where_passed(sign * passed, sign * external, sign * rate)
                                           : own.under_load(-sign * passed, sign * rate).friction;
    return damping[joint] * rate + plain + sign * taken;
  }

  // Where a state belongs; a joint at rest with dry friction is stuck until what it must hold says
  // otherwise.
  DriveMode mode(int joint, double angle, double rate, double demand) const {
    return {limit_mode(joint, demand, rate), stops.mode(joint, angle, rate), sliding(joint, rate)};
  }
  FrictionMode sliding(int joint, double rate) const {
    if (!has_friction(joint)) return FrictionMode::none;
    if (rate == 0.0) return FrictionMode::stuck;
    return rate > 0.0 ? FrictionMode::forward : FrictionMode::backward;
  }

  // All that acts on the joint in a mode, beyond the mode's ends too; without what holds a stuck one.
  // `external` holds the stop's torque here as everywhere, and slopes of it count what friction takes of it.
  DriveTorque torque(int joint, const DriveMode& mode, double angle, double rate, double demand,
                     double external) const {
    const StopTorque stop = stops.on(joint, mode.stop, angle, rate);
    const double motor = torque_on(joint, mode.limit, demand, rate);
    const GearResponse slopes = gear_response(joint, mode.friction, motor, rate, external);
    const double passed = 1.0 - slopes.per_load;
    return {motor - damping[joint] * rate + dry_torque(joint, mode.friction, motor, rate, external) + stop.torque,
            stiffness_after(joint, mode.limit, slopes) + passed * stop.stiffness,
            damping_after(joint, mode.limit, slopes) + damping[joint] + passed * stop.damping};
  }

  // Slopes of the motor's torque on a piece less the gear's friction.
  double stiffness_after(int joint, LimitMode mode, const GearResponse& slopes) const {
    return stiffness_on(joint, mode) * (1.0 - slopes.per_torque);
  }
  double damping_after(int joint, LimitMode mode, const GearResponse& slopes) const {
    return damping_on(joint, mode) * (1.0 - slopes.per_torque) + slopes.per_speed;
  }

  // Where the mode ends: numbers above zero inside of it, negative beyond one of its ends. N m, but the
  // last, of a sliding joint, rad/s. `holding`: torque that a stuck joint must hold, N m.
  std::array<double, kSwitches> switches(int joint, const DriveMode& mode, double angle, double rate,
                                         double demand, double holding, double external) const {
    std::array<double, kSwitches> out;
    out.fill(std::numeric_limits<double>::infinity());
    const double upper = upper_line(joint, rate), lower = lower_line(joint, rate);
    const double most = cap[joint];
    switch (mode.limit) {
      case LimitMode::within:
        out[0] = most - demand, out[1] = most + demand, out[2] = upper - demand, out[3] = demand - lower;
        break;
      case LimitMode::upper_line: out[0] = demand - upper, out[1] = most - upper, out[2] = most + upper; break;
      case LimitMode::lower_line: out[0] = lower - demand, out[1] = most - lower, out[2] = most + lower; break;
      case LimitMode::upper_cap: out[0] = on_line(joint, demand, rate) - most; break;
      case LimitMode::lower_cap: out[0] = -most - on_line(joint, demand, rate); break;
    }
    stops.switches(joint, mode.stop, angle, rate, out[4], out[5]);
    if (mode.friction == FrictionMode::stuck) {
      const double motor = torque_on(joint, mode.limit, demand, rate);
      out[6] = holding_limit(joint, motor, holding, external) - std::abs(holding);
    }
    if (mode.friction == FrictionMode::forward) out[6] = rate;
    if (mode.friction == FrictionMode::backward) out[6] = -rate;
    return out;
  }

 private:
  static double friction_sign(FrictionMode mode) {
    return mode == FrictionMode::forward ? 1.0 : mode == FrictionMode::backward ? -1.0 : 0.0;
  }
};

}  // namespace hexapod
