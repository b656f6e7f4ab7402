// Classical Runge-Kutta of order 4 in the chart of the step's start: explicit, shares no Jacobian.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "plant.hpp"
#include "reference.hpp"

namespace hexapod {

template <class PlantT>
class RungeKutta4 {
 public:
  explicit RungeKutta4(const PlantT& plant)
      : q_(plant.model.nq), v_(plant.model.nv), xi_(plant.model.nv), torque_(plant.joints()),
        q_ref_(plant.joints()), v_ref_(plant.joints()), anchor_(plant.feet.size()),
        slip_(plant.feet.size()) {
    for (auto& k : dxi_) k.resize(plant.model.nv);
    for (auto& k : dv_) k.resize(plant.model.nv);
  }

  // One step from the evaluated state; adds the work done during it to the account.
  void step(PlantT& plant, Reference& reference, double t, double h, VectorXd& q, VectorXd& v,
            Account& account) {
    static constexpr double node[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    const bool bristle = plant.law.friction.kind == FrictionKind::bristle;
    if (bristle) start_bristles(plant);
    for (int s = 0; s < 4; ++s) {
      if (s == 0) {
        q_ = q, v_ = v;
        xi_.setZero();
      } else {
        xi_ = (node[s] * h) * dxi_[s - 1];
        v_ = v + (node[s] * h) * dv_[s - 1];
        retract(q, xi_, q_);
        if (bristle) move_bristles(plant, node[s] * h);
        plant.evaluate(t + node[s] * h, q_, v_, 0.0);
      }
      stage(plant, reference, t + node[s] * h, s);
      plant.add_to(account, v_, torque_, weight[s] * h / 6.0);
      if (bristle) note_slip(plant, weight[s] / 6.0);
    }
    v += (h / 6.0) * (dv_[0] + 2.0 * dv_[1] + 2.0 * dv_[2] + dv_[3]);
    xi_ = (h / 6.0) * (dxi_[0] + 2.0 * dxi_[1] + 2.0 * dxi_[2] + dxi_[3]);
    retract(q, xi_, q);
    if (bristle) end_bristles(plant, h);
  }

  static constexpr bool kAtEnd = false;  // forces belong to the state itself

  std::map<std::string, double> counters() const { return {}; }

 private:
  void stage(PlantT& plant, Reference& reference, double t, int s) {
    reference.at(t, q_ref_, v_ref_);
    plant.servo_torque(q_, v_, q_ref_, v_ref_, torque_);
    plant.acceleration(v_, torque_, dv_[s]);
    chart_rate(xi_, v_, dxi_[s]);
  }

  void start_bristles(PlantT& plant) {
    for (std::size_t i = 0; i < plant.feet.size(); ++i) {
      anchor_[i] = plant.feet[i].memory.stretch;
      slip_[i].setZero();
    }
  }

  static Vec3 slip_of(const typename PlantT::Foot& foot) {
    if (!foot.active) return Vec3::Zero();
    return foot.velocity - foot.ground.normal.dot(foot.velocity) * foot.ground.normal;
  }

  void move_bristles(PlantT& plant, double dt) {
    for (std::size_t i = 0; i < plant.feet.size(); ++i)
      plant.feet[i].memory.stretch = anchor_[i] + dt * slip_of(plant.feet[i]);
  }

  void note_slip(const PlantT& plant, double weight) {
    for (std::size_t i = 0; i < plant.feet.size(); ++i) slip_[i] += weight * slip_of(plant.feet[i]);
  }

  // Back onto the cone with the force of the last stage, which is at the end of the step.
  void end_bristles(PlantT& plant, double h) {
    for (std::size_t i = 0; i < plant.feet.size(); ++i) {
      auto& foot = plant.feet[i];
      foot.memory.stretch = anchor_[i];
      if (foot.active)
        stretch_bristle(plant.law.friction, foot.mu_scale, foot.ground.normal, foot.contact.force,
                        slip_[i], h, foot.memory);
    }
  }

  VectorXd q_, v_, xi_, torque_, q_ref_, v_ref_;
  std::array<VectorXd, 4> dxi_, dv_;
  std::vector<Vec3> anchor_, slip_;
};

}  // namespace hexapod
