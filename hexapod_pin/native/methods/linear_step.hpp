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
        v_ref_(plant.joints()), side_(plant.joints()), released_(plant.feet.size()),
        secant_(plant.feet.size()), force_(plant.feet.size()), velocity_(plant.feet.size()) {}

  // Servos take the set-points at t_end and act there, all within their limits; feet in the ground have
  // a force.
  void begin(const PlantT& plant, Reference& reference, double t_end) {
    reference.at(t_end, q_ref_, v_ref_);
    std::fill(side_.begin(), side_.end(), 0);
    for (std::size_t i = 0; i < released_.size(); ++i) {
      released_[i] = !plant.feet[i].active;
      secant_[i] = false;
    }
  }

  // Servos beyond their limit at the start of the step (all of them within, by `begin`) give the limit.
  void saturate_at_start(const PlantT& plant, const VectorXd& joints, const VectorXd& v) {
    for (int j = 0; j < plant.joints(); ++j) {
      const double demand =
          plant.servo.demand(j, q_ref_[j] - joints[j], v_ref_[j] - v[6 + j]);
      side_[j] = plant.servo.saturation(j, demand);
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
  bool has_force(std::size_t contact) const { return !released_[contact]; }

  // Marks servos that would pass their limit at the end of the step; true if any is new.
  bool find_saturated(const PlantT& plant, double h, const VectorXd& joints) {
    bool found = false;
    for (int j = 0; j < plant.joints(); ++j) {
      if (side_[j] != 0) continue;
      const double demand = end_demand(plant, j, h, joints[j]);
      // A demand that overflows in the solve is not a number: the servo is past its limit too.
      side_[j] = std::isnan(demand) ? -1 : plant.servo.saturation(j, demand, ServoLaw::kLimitSlack);
      found |= side_[j] != 0;
    }
    return found;
  }

  // Forces and contact velocities at the end of the step, as the linearised laws give them.
  void find_end(const PlantT& plant, double h) {
    for (std::size_t i = 0; i < released_.size(); ++i) {
      if (released_[i]) continue;
      const auto& foot = plant.feet[i];
      const Vec3 moved = plant.jacobian_times(i, foot.jb, foot.jl, v_end_) - plant.ground_velocity;
      velocity_[i] = moved + h * plant.jacobian_times(i, foot.qb, foot.ql, v_end_);
      force_[i] = foot.contact.force - foot.contact.slope(secant_[i]) * (velocity_[i] - foot.velocity) -
                  (h * foot.ground.normal.dot(moved)) * foot.contact.minus_dz;
    }
  }

  // Releases feet whose normal force at the end is negative and gives those whose slip would reverse the
  // secant of their friction law; true if any is new. Needs find_end.
  bool find_changed_contacts(const PlantT& plant) {
    bool found = false;
    for (std::size_t i = 0; i < released_.size(); ++i) {
      if (released_[i]) continue;
      const auto& foot = plant.feet[i];
      const Vec3& n = foot.ground.normal;
      if (n.dot(force_[i]) < 0.0) {
        released_[i] = found = true;
      } else if (!secant_[i] && foot.contact.softens && reverses(foot.velocity, velocity_[i], n)) {
        secant_[i] = found = true;
      }
    }
    return found;
  }

  // Works and impulses of the step, from the forces at its end. Needs find_end.
  void accumulate(const PlantT& plant, double h, const VectorXd& joints,
                  EnergyLedger& ledger) const {
    ledger.push += h * plant.push_power(v_end_);
    for (int j = 0; j < plant.joints(); ++j) {
      const double rate = v_end_[6 + j];
      const double torque =
          plant.servo.torque_on(j, side_[j], end_demand(plant, j, h, joints[j]));
      ledger.servo += h * torque * rate;
      ledger.joint_damping += h * plant.servo.damping[j] * rate * rate;
      const StopTorque& stop = plant.stop[j];
      if (stop.stiffness != 0.0) ledger.stops -= h * stop.after(h * rate, rate - plant.rate(j)) * rate;
    }
    for (std::size_t i = 0; i < released_.size(); ++i)
      if (!released_[i])
        ledger.add_contact(i, force_[i], velocity_[i], plant.feet[i].ground.normal, h);
  }

 private:
  void add_joint(PlantT& plant, int j, double h, double angle, double rate) {
    const ServoLaw& servo = plant.servo;
    const StopTorque& stop = plant.stop[j];
    const ServoGains gains = servo.gains(j, side_[j]);
    const double damping = servo.damping[j] + gains.damping;
    const double stiffness = stop.stiffness + gains.stiffness;
    const double demand = servo.demand(j, q_ref_[j] - angle - h * rate, v_ref_[j] - rate);
    double torque = stop.torque - stop.stiffness * h * rate - servo.damping[j] * rate;
    torque += servo.torque_on(j, side_[j], demand);
    acceleration_[6 + j] += torque;
    plant.system.add_diagonal(j, h * (damping + stop.damping + h * stiffness));
  }

  // hD + h^2 K = J^T (h W (J + hQ) + h^2 kz n^T J) on the left; J^T (f - h (W Q + kz n^T J) v) right.
  void add_foot(PlantT& plant, std::size_t i, double h, const VectorXd& v) {
    const auto& foot = plant.feet[i];
    const ContactForce& contact = foot.contact;
    const Vec3& n = foot.ground.normal;
    const Mat3 w = h * contact.slope(secant_[i]);
    const Vec3 k = (h * h) * contact.minus_dz;
    const Eigen::Matrix<double, 3, 6> end_b = foot.jb + h * foot.qb;
    const LegJacobian end_l = foot.jl + h * foot.ql;
    Eigen::Matrix<double, 3, 6> xb = w.lazyProduct(end_b);
    LegJacobian xl = w.lazyProduct(end_l);
    xb.noalias() += k * (n.transpose() * foot.jb);
    xl.noalias() += k * (n.transpose() * foot.jl);
    plant.system.add_foot(int(plant.foot_of(i)), foot.jb, foot.jl, xb, xl);
    const Vec3 drift = plant.jacobian_times(i, foot.qb, foot.ql, v);
    const Vec3 f = contact.force - w * drift - (h * n.dot(foot.velocity)) * contact.minus_dz;
    plant.add_jacobian_transposed(i, f, acceleration_);
  }

  double end_demand(const PlantT& plant, int j, double h, double angle) const {
    const double rate = v_end_[6 + j];
    return plant.servo.demand(j, q_ref_[j] - angle - h * rate, v_ref_[j] - rate);
  }

  // Whether the slip, the part of the contact velocity across n, changes to the opposite direction.
  static bool reverses(const Vec3& before, const Vec3& after, const Vec3& n) {
    return before.dot(after) - n.dot(before) * n.dot(after) < 0.0;
  }

  VectorXd acceleration_, v_end_, q_ref_, v_ref_;
  std::vector<LimitSide> side_;  // of each servo's limit
  std::vector<char> released_;   // contacts without force in this step
  std::vector<char> secant_;     // contacts with the secant of their friction law
  std::vector<Vec3> force_, velocity_;
};

}  // namespace hexapod
