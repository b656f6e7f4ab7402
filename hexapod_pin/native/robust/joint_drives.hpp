// Drives of a robust step: they act at its end, linear in the joint rates but for their modes; those are
// found by solving again.
#pragma once

#include <cmath>
#include <vector>

#include "laws/drive.hpp"
#include "plant/drive_counters.hpp"
#include "plant/energy_ledger.hpp"
#include "plant/set_points.hpp"

namespace hexapod {

class JointDrives {
 public:
  explicit JointDrives(int joints)
      : set_points_(joints), diagonal_(joints), external_(VectorXd::Zero(joints)), joints_(joints) {}

  // `dry`: a joint has dry friction. `q` and `v` (n) joint angles and rates at the start of a step that ends at `end`. A stuck joint
  // changes its rate by `stop_share` of what would bring the rate used over the step to zero.
  void begin(const DriveLaw& law, bool dry, Reference& reference, double end, double h,
             double stop_share, const VectorXd& q, const VectorXd& v) {
    law_ = &law, dry_ = dry, h_ = h, stop_share_ = stop_share, q_ = q;
    set_points_.take(reference, end);
    switched_ = false;
    for (int j = 0; j < q.size(); ++j) {
      const double beyond = law.stops.present(j) ? law.stops.beyond(j, q[j]) : 0.0;
      joints_[j] = {LimitMode::within, dry_ ? law.sliding(j, v[j]) : FrictionMode::none, 0, beyond, false};
      switched_ |= beyond != 0.0;
    }
  }

  // Adds weight * torque at the start rates `v` (n) to `right` (n), and finds the diagonal.
  template <class Right>
  void load(double weight, const VectorXd& v, Right&& right) {
    for (int j = 0; j < v.size(); ++j) {
      JointState& joint = joints_[j];
      double damping = law_->damping[j] + law_->damping_on(j, joint.limit);
      double stiffness = law_->stiffness_on(j, joint.limit);
      const double angle = q_[j] + h_ * v[j];
      // the dampers act through `damping`, so the torque is the one at zero rate
      const double demand = law_->demand(j, set_points_.q[j] - q_[j] - h_ * v[j], set_points_.v[j],
                                         set_points_.torque[j]);
      double torque = law_->torque_on(j, joint.limit, demand, 0.0);
      if (joint.beyond != 0.0) {  // the stop's damper at the depth known so far
        torque += law_->stops.elastic_torque(j, joint.beyond, angle);
        damping += law_->stops.damping(j, joint.beyond);
        stiffness += law_->stops.stiffness[j];
      }
      if (dry_) {
        linearise_friction(j, demand - law_->kd[j] * v[j], v[j]);
        torque += joint.dry + joint.dry_damping * v[j];
        damping += joint.dry_damping;
        stiffness += joint.dry_stiffness;
      }
      right[j] += weight * (torque - damping * v[j]);
      diagonal_[j] = weight * (damping + h_ * stiffness);
      if (joint.friction != FrictionMode::stuck) continue;
      right[j] -= kLock * stop_share_ * v[j];
      diagonal_[j] += kLock;
    }
  }

  // External torques on the joints (n), N m, that gears' friction depends on: those of the step's start to
  // begin with, then those of the pass before.
  VectorXd& external() { return external_; }

  const VectorXd& diagonal() const { return diagonal_; }
  bool dry() const { return dry_; }
  bool stuck(int j) const { return joints_[j].friction == FrictionMode::stuck; }

  // At the rates found: a servo past its limit gets it; a joint that ends beyond its range gets the
  // stop; a stop that would pull is released. True if anything changed.
  bool find_changes(const VectorXd& rate) {
    bool found = false;
    for (int j = 0; j < rate.size(); ++j) {
      found |= limit_changes(j, rate[j]);
      if (law_->stops.present(j) && !joints_[j].released) found |= stop_changes(j, rate[j]);
    }
    switched_ |= found;
    return found;
  }

  // Joints that would end turning back under their friction are stuck; those stuck slide where the torque
  // left to them exceeds it. `rate_end` at the end, `rate` used over the step, `left` (n): the torque left
  // by everything but the drives, N m. True if anything changed.
  bool find_friction_changes(const VectorXd& rate_end, const VectorXd& rate, const VectorXd& left) {
    bool found = false;
    for (int j = 0; j < rate.size(); ++j) {
      JointState& joint = joints_[j];
      const double motor = law_->torque_on(j, joint.limit, demand(j, rate[j]), rate[j]);
      const FrictionMode next =
          next_friction(j, rate_end[j], left[j] + passive_torque(j, rate[j]), motor);
      if (next == joint.friction || joint.friction_changes >= kMaxFrictionChanges) continue;
      joint.friction = next;
      ++joint.friction_changes;
      found = true;
    }
    return found;
  }

  // Takes the external torques (n), N m, found at the rates used over the step; those of stops come to them.
  // True if the friction of a gear changes by it.
  bool find_load_changes(const VectorXd& rate, const VectorXd& external) {
    bool found = false;
    for (int j = 0; j < rate.size(); ++j) {
      const FrictionMode mode = joints_[j].friction;
      const double motor = law_->torque_on(j, joints_[j].limit, demand(j, rate[j]), rate[j]);
      const double before = law_->dry_torque(j, mode, motor, rate[j], external_[j]);
      external_[j] = external[j] + stop_torque(j, rate[j]);
      const double after = law_->dry_torque(j, mode, motor, rate[j], external_[j]);
      found |= std::abs(after - before) > kLoadSlack * std::abs(after);
    }
    return found;
  }

  void accumulate(const VectorXd& rate, EnergyLedger& ledger, DriveCounters& counters) const {
    for (int j = 0; j < rate.size(); ++j) {
      const JointState& joint = joints_[j];
      const double motor = law_->torque_on(j, joint.limit, demand(j, rate[j]), rate[j]);
      ledger.servo += h_ * motor * rate[j];
      ledger.joint_damping += h_ * law_->damping[j] * rate[j] * rate[j];
      if (dry_) ledger.joint_damping -= h_ * friction_torque(j, rate[j]) * rate[j];
      ledger.stops -= h_ * stop_torque(j, rate[j]) * rate[j];
    }
    if (!switched_ && counters.idle()) return;
    for (int j = 0; j < rate.size(); ++j)
      counters.add(j, joints_[j].limit, joints_[j].beyond != 0.0 ? StopMode::upper : StopMode::free, h_);
  }

 private:
  static constexpr double kFrictionSlack = 1e-9;  // -, of the round-off in what is left
  static constexpr int kMaxFrictionChanges = 4;   // of one joint in one step
  // Change of a gear's friction with the external torque for which a step is not solved again, -: it is far
  // below what a step of this method is off by.
  static constexpr double kLoadSlack = 1e-4;

  struct JointState {
    LimitMode limit = LimitMode::within;
    FrictionMode friction = FrictionMode::none;
    int friction_changes = 0;
    double beyond = 0.0;    // how far beyond its range, signed, rad; 0: no stop
    bool released = false;  // its stop would have pulled
    double holding = 0.0;   // torque left to it while it is stuck, N m
    // dry friction at the rate at the step's start and its negative slopes, as for a DriveTorque
    double dry = 0.0, dry_stiffness = 0.0, dry_damping = 0.0, start_rate = 0.0;
  };

  double demand(int j, double rate) const {  // at the end of the step
    return law_->demand(j, set_points_.q[j] - q_[j] - h_ * rate, set_points_.v[j] - rate,
                        set_points_.torque[j]);
  }

  double stop_torque(int j, double rate) const {
    const double beyond = joints_[j].beyond;
    if (beyond == 0.0) return 0.0;
    return law_->stops.elastic_torque(j, beyond, q_[j] + h_ * rate) -
           law_->stops.damping(j, beyond) * rate;
  }

  double passive_torque(int j, double rate) const {  // of motor, damper and stop
    return law_->torque_on(j, joints_[j].limit, demand(j, rate), rate) - law_->damping[j] * rate +
           stop_torque(j, rate);
  }

  double friction_torque(int j, double rate) const {
    const JointState& joint = joints_[j];
    if (joint.friction == FrictionMode::stuck) return -joint.holding;
    return joint.dry - (joint.dry_damping + h_ * joint.dry_stiffness) * (rate - joint.start_rate);
  }

  // Of a joint that slides, at the demand [N m] that the start's rate gives at the end of the step.
  void linearise_friction(int j, double demand, double rate) {
    JointState& joint = joints_[j];
    const double motor = law_->torque_on(j, joint.limit, demand, rate);
    const GearResponse slopes = law_->gear_response(j, joint.friction, motor, rate, external_[j]);
    joint.dry = law_->dry_torque(j, joint.friction, motor, rate, external_[j]);
    joint.dry_stiffness = law_->stiffness_after(j, joint.limit, slopes) - law_->stiffness_on(j, joint.limit);
    joint.dry_damping = law_->damping_after(j, joint.limit, slopes) - law_->damping_on(j, joint.limit);
    joint.start_rate = rate;
  }

  bool limit_changes(int j, double rate) {
    LimitMode& now = joints_[j].limit;
    if (now != LimitMode::within && law_->line_slope[j] == 0.0) return false;
    const LimitMode next = law_->limit_mode(j, demand(j, rate), rate, DriveLaw::kLimitSlack);
    if (next == now || next == LimitMode::within) return false;
    now = next;
    return true;
  }

  FrictionMode next_friction(int j, double rate_end, double holding, double motor) {
    JointState& joint = joints_[j];
    const FrictionMode now = joint.friction;
    if (now == FrictionMode::forward) return rate_end < 0.0 ? FrictionMode::stuck : now;
    if (now == FrictionMode::backward) return rate_end > 0.0 ? FrictionMode::stuck : now;
    if (now == FrictionMode::none) return now;
    joint.holding = holding;
    const double limit = law_->holding_limit(j, motor, holding, external_[j]);
    if (!(std::abs(holding) > limit * (1.0 + kFrictionSlack))) return now;
    return holding > 0.0 ? FrictionMode::forward : FrictionMode::backward;
  }

  bool stop_changes(int j, double rate) {
    JointState& joint = joints_[j];
    if (joint.beyond == 0.0) {
      joint.beyond = law_->stops.beyond(j, q_[j] + h_ * rate);
      return joint.beyond != 0.0;
    }
    if (stop_torque(j, rate) * joint.beyond <= 0.0) return false;
    joint.beyond = 0.0;
    return joint.released = true;
  }

  const DriveLaw* law_ = nullptr;
  double h_ = 0.0, stop_share_ = 1.0;
  bool dry_ = false, switched_ = false;  // a joint has dry friction; is at its limit or a stop
  VectorXd q_, diagonal_, external_;
  SetPoints set_points_;
  std::vector<JointState> joints_;
};

}  // namespace hexapod
