// Servos and joint stops of a robust step: both act at its end, linear in the joint rates but for
// which of them are at their limits; that is found by solving again.
#pragma once

#include <vector>

#include "laws/joint_stops.hpp"
#include "laws/servo.hpp"
#include "plant/energy_ledger.hpp"
#include "plant/reference.hpp"

namespace hexapod {

class JointDrives {
 public:
  explicit JointDrives(int joints)
      : q_ref_(joints), v_ref_(joints), diagonal_(joints), joints_(joints) {}

  // `q` (n) joint angles at the start of a step that ends at `end`.
  void begin(const ServoLaw& servo, const JointStops& stops, Reference& reference, double end,
             double h, const VectorXd& q) {
    servo_ = &servo, stops_ = &stops, h_ = h, q_ = q;
    reference.at(end, q_ref_, v_ref_);
    for (int j = 0; j < q.size(); ++j)
      joints_[j] = {0, stops.present() ? stops.beyond(j, q[j]) : 0.0, false};
  }

  // Adds weight * torque at the start rates `v` (n) to `right` (n), and finds the diagonal.
  template <class Right>
  void load(double weight, const VectorXd& v, Right&& right) {
    for (int j = 0; j < v.size(); ++j) {
      const JointState& joint = joints_[j];
      const ServoGains gains = servo_->gains(j, joint.side);
      double damping = servo_->damping[j] + gains.damping, stiffness = gains.stiffness;
      const double angle = q_[j] + h_ * v[j];
      // the dampers act through `damping`, so the demand is the one at zero rate
      double torque = servo_->torque_on(
          j, joint.side, servo_->demand(j, q_ref_[j] - q_[j] - h_ * v[j], v_ref_[j]));
      if (joint.beyond != 0.0) {  // the stop's damper at the depth known so far
        torque += stops_->elastic_torque(j, joint.beyond, angle);
        damping += stops_->damping(joint.beyond);
        stiffness += stops_->stiffness;
      }
      right[j] += weight * (torque - damping * v[j]);
      diagonal_[j] = weight * (damping + h_ * stiffness);
    }
  }

  const VectorXd& diagonal() const { return diagonal_; }

  // At the rates found: a servo past its limit gets the limit as a constant torque; a joint that ends
  // beyond its range gets the stop; a stop that would pull is released. True if anything changed.
  bool find_changes(const VectorXd& rate) {
    bool found = false;
    for (int j = 0; j < rate.size(); ++j) {
      JointState& joint = joints_[j];
      if (joint.side == 0) {
        joint.side = servo_->saturation(j, demand(j, rate[j]), ServoLaw::kLimitSlack);
        found |= joint.side != 0;
      }
      if (stops_->present() && !joint.released) found |= stop_changes(j, rate[j]);
    }
    return found;
  }

  void accumulate(const VectorXd& rate, EnergyLedger& ledger) const {
    for (int j = 0; j < rate.size(); ++j) {
      const double servo = servo_->torque_on(j, joints_[j].side, demand(j, rate[j]));
      ledger.servo += h_ * servo * rate[j];
      ledger.joint_damping += h_ * servo_->damping[j] * rate[j] * rate[j];
      ledger.stops -= h_ * stop_torque(j, rate[j]) * rate[j];
    }
  }

 private:
  struct JointState {
    LimitSide side = 0;     // of the servo's limit
    double beyond = 0.0;    // how far beyond its range, signed, rad; 0: no stop
    bool released = false;  // its stop would have pulled
  };

  double demand(int j, double rate) const {  // at the end of the step
    return servo_->demand(j, q_ref_[j] - q_[j] - h_ * rate, v_ref_[j] - rate);
  }

  double stop_torque(int j, double rate) const {
    const double beyond = joints_[j].beyond;
    if (beyond == 0.0) return 0.0;
    return stops_->elastic_torque(j, beyond, q_[j] + h_ * rate) - stops_->damping(beyond) * rate;
  }

  bool stop_changes(int j, double rate) {
    JointState& joint = joints_[j];
    if (joint.beyond == 0.0) {
      joint.beyond = stops_->beyond(j, q_[j] + h_ * rate);
      return joint.beyond != 0.0;
    }
    if (stop_torque(j, rate) * joint.beyond <= 0.0) return false;
    joint.beyond = 0.0;
    return joint.released = true;
  }

  const ServoLaw* servo_ = nullptr;
  const JointStops* stops_ = nullptr;
  double h_ = 0.0;
  VectorXd q_, q_ref_, v_ref_, diagonal_;
  std::vector<JointState> joints_;
};

}  // namespace hexapod
