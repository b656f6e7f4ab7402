// Linearly implicit Euler: (M + hD + h^2 K) a = g - h K v, v += h a, q moves with the new v.
// Order 1; one evaluation and one factorisation a step. Contact Jacobian complete and nonsymmetric.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "plant.hpp"
#include "reference.hpp"

namespace hexapod {

template <class PlantT>
class ImplicitEuler {
  using LegJacobian = typename PlantT::System::LegJacobian;

 public:
  explicit ImplicitEuler(const PlantT& plant)
      : acceleration_(plant.model.nv), xi_(plant.model.nv), v_new_(plant.model.nv),
        q_ref_(plant.joints()), v_ref_(plant.joints()), mode_(plant.joints()),
        released_(plant.feet.size()), secant_(plant.feet.size()), force_(plant.feet.size()), velocity_(plant.feet.size()) {}

  // One step from the evaluated state. Servos and feet act at the end of the step. A joint whose
  // torque would pass its limit there gets the limit as a constant torque; a foot that would be
  // pulled lets go; a foot whose slip would turn round takes the secant of its friction law, because
  // past the bend the tangent vanishes and would throw it back and forth; and the step is solved again.
  void step(PlantT& plant, Reference& reference, double t, double h, VectorXd& q, VectorXd& v,
            Account& account) {
    reference.at(t + h, q_ref_, v_ref_);
    std::fill(mode_.begin(), mode_.end(), 0);
    for (std::size_t i = 0; i < released_.size(); ++i) {
      released_[i] = !plant.feet[i].active;
      secant_[i] = false;
    }
    for (int pass = 0;; ++pass) {
      solve(plant, h, q, v);
      v_new_ = v + h * acceleration_;
      const bool saturated = find_saturated(plant, h, q), changed = find_changed(plant, h);
      if (!(saturated || changed) || pass == kMostPasses) break;
      ++solved_again_;
    }
    keep_book(plant, h, q, account);
    v = v_new_;
    xi_ = h * v;
    retract(q, xi_, q);
  }

  static constexpr bool kAtEnd = true;  // contact forces belong to the end of the step

  std::map<std::string, double> counters() const { return {{"solved_again", double(solved_again_)}}; }

 private:
  static constexpr int kMostPasses = 8;

  void solve(PlantT& plant, double h, const VectorXd& q, const VectorXd& v) {
    auto& system = plant.system;
    system.load(plant.mass_upper());
    acceleration_ = -plant.bias();
    for (int j = 0; j < plant.joints(); ++j) add_servo(plant, j, h, q[7 + j], v[6 + j]);
    for (std::size_t i = 0; i < plant.feet.size(); ++i)
      if (!released_[i]) add_foot(plant, i, h, v);
    system.factor();
    system.solve(acceleration_);
  }

  void add_servo(PlantT& plant, int j, double h, double angle, double rate) {
    const Servo& servo = plant.servo;
    double damping = servo.damping[j], stiffness = 0.0, torque = 0.0;
    if (mode_[j] != 0) torque = mode_[j] * servo.limit[j];
    if (mode_[j] == 0) {
      damping += servo.kd[j];
      stiffness = servo.kp[j];
      torque = stiffness * (q_ref_[j] - angle - h * rate) + servo.kd[j] * v_ref_[j];
    }
    acceleration_[6 + j] += torque - damping * rate;
    plant.system.add_diagonal(j, h * (damping + h * stiffness));
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
    const Vec3 f = contact.force - w * drift -
                   (h * n.dot(foot.velocity)) * contact.minus_dz;
    plant.add_transposed(i, f, acceleration_);
  }

  // Marks servos that would pass their limit at the end of the step; true if any is new.
  bool find_saturated(const PlantT& plant, double h, const VectorXd& q) {
    bool found = false;
    for (int j = 0; j < plant.joints(); ++j) {
      if (mode_[j] != 0) continue;
      const double torque = end_torque(plant, j, h, q);
      if (std::abs(torque) <= plant.servo.limit[j] * (1.0 + 1e-12)) continue;
      mode_[j] = torque > 0.0 ? 1 : -1;
      found = true;
    }
    return found;
  }

  double end_torque(const PlantT& plant, int j, double h, const VectorXd& q) const {
    const double rate = v_new_[6 + j];
    if (mode_[j] != 0) return mode_[j] * plant.servo.limit[j];
    return plant.servo.kp[j] * (q_ref_[j] - q[7 + j] - h * rate) +
           plant.servo.kd[j] * (v_ref_[j] - rate);
  }

  Mat3 slope(std::size_t i, const ContactForce& contact) const {
    return secant_[i] ? Mat3(contact.minus_du + contact.bend) : contact.minus_du;
  }

  // Forces and contact velocities at the end of the step, as the linearised laws give them; releases
  // the feet that would be pulled and flags those that would turn round, true if any is new.
  bool find_changed(const PlantT& plant, double h) {
    bool found = false;
    for (std::size_t i = 0; i < released_.size(); ++i) {
      if (released_[i]) continue;
      const auto& foot = plant.feet[i];
      const Vec3& n = foot.ground.normal;
      const Vec3 moved = plant.along(i, foot.jb, foot.jl, v_new_) - plant.ground_velocity;
      velocity_[i] = moved + h * plant.along(i, foot.qb, foot.ql, v_new_);
      force_[i] = foot.contact.force - slope(i, foot.contact) * (velocity_[i] - foot.velocity) -
                  (h * n.dot(moved)) * foot.contact.minus_dz;
      if (n.dot(force_[i]) < 0.0) {
        released_[i] = found = true;
      } else if (!secant_[i] && foot.contact.bends &&
                 turns_round(foot.velocity, velocity_[i], n)) {
        secant_[i] = found = true;
      }
    }
    return found;
  }

  static bool turns_round(const Vec3& before, const Vec3& after, const Vec3& n) {
    return before.dot(after) - n.dot(before) * n.dot(after) < 0.0;
  }

  void keep_book(PlantT& plant, double h, const VectorXd& q, Account& account) const {
    for (int j = 0; j < plant.joints(); ++j) {
      const double rate = v_new_[6 + j];
      account.servo += h * end_torque(plant, j, h, q) * rate;
      account.joint_damping += h * plant.servo.damping[j] * rate * rate;
    }
    for (std::size_t i = 0; i < released_.size(); ++i) {
      if (released_[i]) continue;
      auto& foot = plant.feet[i];
      account.add_contact(i, force_[i], velocity_[i], foot.ground.normal, h);
      if (plant.law.friction.kind == FrictionKind::bristle)
        stretch_bristle(plant.law.friction, foot.mu_scale, foot.ground.normal, force_[i],
                        velocity_[i], h, foot.memory);
    }
  }

  VectorXd acceleration_, xi_, v_new_, q_ref_, v_ref_;
  std::vector<int> mode_;        // 0 = PD, +1/-1 = at the limit
  std::vector<char> released_;   // contacts without force in this step
  std::vector<char> secant_;     // contacts with the secant of their friction law
  std::vector<Vec3> force_, velocity_;
  long solved_again_ = 0;
};

}  // namespace hexapod
