// One linearly implicit step from an evaluated state: (M + hD + h^2 K) a = g - h K v, with the complete,
// nonsymmetric contact Jacobian, servos and joint stops in D and K; and what it says of the step's end.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "plant/plant.hpp"
#include "plant/reference.hpp"

namespace hexapod {

template <class PlantT>
class LinearStep {
  using LegJacobian = typename PlantT::System::LegJacobian;

 public:
  explicit LinearStep(const PlantT& plant)
      : acceleration_(plant.tree.nv), v_end_(plant.tree.nv), q_ref_(plant.joints()),
        v_ref_(plant.joints()), mode_(plant.joints()), released_(plant.feet.size()),
        secant_(plant.feet.size()), force_(plant.feet.size()), velocity_(plant.feet.size()) {}

  // Servos take the set-points at t_end and act there, all within their limits; feet in the ground push.
  void begin(const PlantT& plant, Reference& reference, double t_end) {
    reference.at(t_end, q_ref_, v_ref_);
    std::fill(mode_.begin(), mode_.end(), 0);
    for (std::size_t i = 0; i < released_.size(); ++i) {
      released_[i] = !plant.feet[i].active;
      secant_[i] = false;
    }
  }

  // Servos beyond their limit at the start of the step give the limit.
  void clip_at_start(const PlantT& plant, const VectorXd& joints, const VectorXd& v) {
    for (int j = 0; j < plant.joints(); ++j) {
      const double torque = plant.servo.kp[j] * (q_ref_[j] - joints[j]) +
                            plant.servo.kd[j] * (v_ref_[j] - v[6 + j]);
      if (std::abs(torque) > plant.servo.limit[j]) mode_[j] = torque > 0.0 ? 1 : -1;
    }
  }

  void solve(PlantT& plant, double h, const VectorXd& joints, const VectorXd& v) {
    auto& system = plant.system;
    system.load(plant.mass_upper());
    acceleration_ = -plant.bias();
    for (int j = 0; j < plant.joints(); ++j) add_joint(plant, j, h, joints[j], v[6 + j]);
    for (std::size_t i = 0; i < plant.feet.size(); ++i)
      if (!released_[i]) add_foot(plant, i, h, v);
    system.factor();
    system.solve(acceleration_);
    v_end_ = v + h * acceleration_;
  }

  const VectorXd& v_end() const { return v_end_; }
  const Vec3& force(std::size_t contact) const { return force_[contact]; }  // at the end, on the foot
  bool pushes(std::size_t contact) const { return !released_[contact]; }

  // Marks servos that would pass their limit at the end of the step; true if any is new.
  bool find_saturated(const PlantT& plant, double h, const VectorXd& joints) {
    bool found = false;
    for (int j = 0; j < plant.joints(); ++j) {
      if (mode_[j] != 0) continue;
      const double torque = end_torque(plant, j, h, joints[j]);
      if (std::abs(torque) <= plant.servo.limit[j] * (1.0 + 1e-12)) continue;
      mode_[j] = torque > 0.0 ? 1 : -1;
      found = true;
    }
    return found;
  }

  // Forces and contact velocities at the end of the step, as the linearised laws give them.
  void find_end(const PlantT& plant, double h) {
    for (std::size_t i = 0; i < released_.size(); ++i) {
      if (released_[i]) continue;
      const auto& foot = plant.feet[i];
      const Vec3 moved = plant.along(i, foot.jb, foot.jl, v_end_) - plant.ground_velocity;
      velocity_[i] = moved + h * plant.along(i, foot.qb, foot.ql, v_end_);
      force_[i] = foot.contact.force - slope(i, foot.contact) * (velocity_[i] - foot.velocity) -
                  (h * foot.ground.normal.dot(moved)) * foot.contact.minus_dz;
    }
  }

  // Releases the feet that would be pulled at the end and flags those whose slip would turn round,
  // true if any is new. Needs find_end.
  bool find_changed(const PlantT& plant) {
    bool found = false;
    for (std::size_t i = 0; i < released_.size(); ++i) {
      if (released_[i]) continue;
      const auto& foot = plant.feet[i];
      const Vec3& n = foot.ground.normal;
      if (n.dot(force_[i]) < 0.0) {
        released_[i] = found = true;
      } else if (!secant_[i] && foot.contact.bends && turns_round(foot.velocity, velocity_[i], n)) {
        secant_[i] = found = true;
      }
    }
    return found;
  }

  // Works and impulses of the step, from the forces at its end. Needs find_end.
  void keep_book(const PlantT& plant, double h, const VectorXd& joints, EnergyLedger& ledger) const {
    for (int j = 0; j < plant.joints(); ++j) {
      const double rate = v_end_[6 + j];
      ledger.servo += h * end_torque(plant, j, h, joints[j]) * rate;
      ledger.joint_damping += h * plant.servo.damping[j] * rate * rate;
      const StopPush& stop = plant.stop[j];
      if (stop.stiffness != 0.0) ledger.stops -= h * end_push(stop, h, plant.rate(j), rate) * rate;
    }
    for (std::size_t i = 0; i < released_.size(); ++i)
      if (!released_[i])
        ledger.add_contact(i, force_[i], velocity_[i], plant.feet[i].ground.normal, h);
  }

 private:
  static double end_push(const StopPush& stop, double h, double rate, double rate_end) {
    return stop.torque - stop.damping * (rate_end - rate) - stop.stiffness * h * rate_end;
  }

  void add_joint(PlantT& plant, int j, double h, double angle, double rate) {
    const Servo& servo = plant.servo;
    const StopPush& stop = plant.stop[j];
    double damping = servo.damping[j], stiffness = stop.stiffness;
    double torque = stop.torque - stop.stiffness * h * rate - servo.damping[j] * rate;
    if (mode_[j] != 0) {
      torque += mode_[j] * servo.limit[j];
    } else {
      damping += servo.kd[j];
      stiffness += servo.kp[j];
      torque += servo.kp[j] * (q_ref_[j] - angle - h * rate) + servo.kd[j] * (v_ref_[j] - rate);
    }
    acceleration_[6 + j] += torque;
    plant.system.add_diagonal(j, h * (damping + stop.damping + h * stiffness));
  }

  // hD + h^2 K = J^T (h W (J + hQ) + h^2 kz n^T J) on the left; J^T (f - h (W Q + kz n^T J) v) right.
  void add_foot(PlantT& plant, std::size_t i, double h, const VectorXd& v) {
    const auto& foot = plant.feet[i];
    const ContactForce& contact = foot.contact;
    const Vec3& n = foot.ground.normal;
    const Mat3 w = h * slope(i, contact);
    const Vec3 k = (h * h) * contact.minus_dz;
    const Eigen::Matrix<double, 3, 6> end_b = foot.jb + h * foot.qb;
    const LegJacobian end_l = foot.jl + h * foot.ql;
    Eigen::Matrix<double, 3, 6> xb = w.lazyProduct(end_b);
    LegJacobian xl = w.lazyProduct(end_l);
    xb.noalias() += k * (n.transpose() * foot.jb);
    xl.noalias() += k * (n.transpose() * foot.jl);
    plant.system.add_foot(int(plant.foot_of(i)), foot.jb, foot.jl, xb, xl);
    const Vec3 drift = plant.along(i, foot.qb, foot.ql, v);
    const Vec3 f = contact.force - w * drift - (h * n.dot(foot.velocity)) * contact.minus_dz;
    plant.add_transposed(i, f, acceleration_);
  }

  double end_torque(const PlantT& plant, int j, double h, double angle) const {
    const double rate = v_end_[6 + j];
    if (mode_[j] != 0) return mode_[j] * plant.servo.limit[j];
    return plant.servo.kp[j] * (q_ref_[j] - angle - h * rate) +
           plant.servo.kd[j] * (v_ref_[j] - rate);
  }

  Mat3 slope(std::size_t i, const ContactForce& contact) const {
    return secant_[i] ? Mat3(contact.minus_du + contact.bend) : contact.minus_du;
  }

  static bool turns_round(const Vec3& before, const Vec3& after, const Vec3& n) {
    return before.dot(after) - n.dot(before) * n.dot(after) < 0.0;
  }

  VectorXd acceleration_, v_end_, q_ref_, v_ref_;
  std::vector<int> mode_;        // of each servo: 0 PD, +1 or -1 at the limit
  std::vector<char> released_;   // contacts without force in this step
  std::vector<char> secant_;     // contacts with the secant of their friction law
  std::vector<Vec3> force_, velocity_;
};

}  // namespace hexapod
