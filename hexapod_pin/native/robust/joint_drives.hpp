// Servos and joint stops of a robust step: both act at its end, linear in the joint rates but for
// which of them are at their limits; that is found by solving again.
#pragma once

#include <cmath>
#include <vector>

#include "laws/servo.hpp"
#include "laws/stops.hpp"
#include "plant/energy_ledger.hpp"
#include "plant/reference.hpp"

namespace hexapod {

class JointDrives {
 public:
  explicit JointDrives(int joints) : q_ref_(joints), v_ref_(joints), diagonal_(joints), joints_(joints) {}

  // `q` (n) joint angles at the start of a step that ends at `end`.
  void begin(const Servo& servo, const JointStops& stops, Reference& reference, double end, double h,
             const Eigen::VectorXd& q) {
    servo_ = &servo, stops_ = &stops, h_ = h, q_ = q;
    reference.at(end, q_ref_, v_ref_);
    for (int j = 0; j < q.size(); ++j)
      joints_[j] = {0, stops.stiffness > 0.0 ? stops.beyond(j, q[j]) : 0.0, false};
  }

  // Adds weight * torque at the start rates `v` (n) to `right` (n), and finds the diagonal.
  template <class Right>
  void load(double weight, const Eigen::VectorXd& v, Right&& right) {
    for (int j = 0; j < v.size(); ++j) {
      const Joint& joint = joints_[j];
      double damping = servo_->damping[j], stiffness = 0.0, torque = joint.full * servo_->limit[j];
      if (joint.full == 0) {
        damping += servo_->kd[j];
        stiffness = servo_->kp[j];
        torque = stiffness * (q_ref_[j] - q_[j] - h_ * v[j]) + servo_->kd[j] * v_ref_[j];
      }
      if (joint.beyond != 0.0) {  // the stop's damper as deep as known
        torque -= stops_->stiffness * (q_[j] + h_ * v[j] - end_of(j));
        damping += stop_damping(j);
        stiffness += stops_->stiffness;
      }
      right[j] += weight * (torque - damping * v[j]);
      diagonal_[j] = weight * (damping + h_ * stiffness);
    }
  }

  const Eigen::VectorXd& diagonal() const { return diagonal_; }

  // At the rates found: a servo past its limit gets the limit as a constant torque; a joint that ends
  // beyond its range gets the stop; a stop that would pull lets go. True if anything changed.
  bool find_changes(const Eigen::VectorXd& rate) {
    bool found = false;
    for (int j = 0; j < rate.size(); ++j) {
      Joint& joint = joints_[j];
      const double wanted = servo_torque(j, rate[j]);
      if (joint.full == 0 && std::abs(wanted) > servo_->limit[j] * (1.0 + 1e-12)) {
        joint.full = wanted > 0.0 ? 1 : -1;
        found = true;
      }
      if (stops_->stiffness > 0.0 && !joint.released) found |= meets_stop(j, rate[j]);
    }
    return found;
  }

  void keep_book(const Eigen::VectorXd& rate, EnergyLedger& ledger) const {
    for (int j = 0; j < rate.size(); ++j) {
      ledger.servo += h_ * servo_torque(j, rate[j]) * rate[j];
      ledger.joint_damping += h_ * servo_->damping[j] * rate[j] * rate[j];
      ledger.stops -= h_ * stop_torque(j, rate[j]) * rate[j];
    }
  }

 private:
  struct Joint {
    int full = 0;           // +1, -1: the servo gives its limit
    double beyond = 0.0;    // how far beyond its range, signed, rad; 0: no stop
    bool released = false;  // its stop would have pulled
  };

  double end_of(int j) const { return joints_[j].beyond > 0.0 ? stops_->upper[j] : stops_->lower[j]; }

  double stop_damping(int j) const {
    return 1.5 * stops_->dissipation * stops_->stiffness * std::abs(joints_[j].beyond);
  }

  double servo_torque(int j, double rate) const {
    if (joints_[j].full != 0) return joints_[j].full * servo_->limit[j];
    return servo_->kp[j] * (q_ref_[j] - q_[j] - h_ * rate) + servo_->kd[j] * (v_ref_[j] - rate);
  }

  double stop_torque(int j, double rate) const {
    if (joints_[j].beyond == 0.0) return 0.0;
    return -stops_->stiffness * (q_[j] + h_ * rate - end_of(j)) - stop_damping(j) * rate;
  }

  bool meets_stop(int j, double rate) {
    Joint& joint = joints_[j];
    if (joint.beyond == 0.0) {
      joint.beyond = stops_->beyond(j, q_[j] + h_ * rate);
      return joint.beyond != 0.0;
    }
    if (stop_torque(j, rate) * joint.beyond <= 0.0) return false;
    joint.beyond = 0.0;
    return joint.released = true;
  }

  const Servo* servo_ = nullptr;
  const JointStops* stops_ = nullptr;
  double h_ = 0.0;
  Eigen::VectorXd q_, q_ref_, v_ref_, diagonal_;
  std::vector<Joint> joints_;
};

}  // namespace hexapod
