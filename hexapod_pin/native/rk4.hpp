// Classical Runge-Kutta of order 4 in the chart of the step's start: explicit, shares no Jacobian.
#pragma once

#include <array>
#include <map>
#include <string>

#include "plant.hpp"
#include "reference.hpp"

namespace hexapod {

template <class PlantT>
class RungeKutta4 {
 public:
  explicit RungeKutta4(const PlantT& plant)
      : q_(plant.model.nq), v_(plant.model.nv), xi_(plant.model.nv), torque_(plant.joints()),
        q_ref_(plant.joints()), v_ref_(plant.joints()) {
    for (auto& k : dxi_) k.resize(plant.model.nv);
    for (auto& k : dv_) k.resize(plant.model.nv);
  }

  // One step from the evaluated state; adds the work done during it to the account.
  void step(PlantT& plant, Reference& reference, double t, double h, VectorXd& q, VectorXd& v,
            Account& account) {
    static constexpr double node[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    for (int s = 0; s < 4; ++s) {
      if (s == 0) {
        q_ = q, v_ = v;
        xi_.setZero();
      } else {
        xi_ = (node[s] * h) * dxi_[s - 1];
        v_ = v + (node[s] * h) * dv_[s - 1];
        retract(q, xi_, q_);
        plant.evaluate(q_, v_);
      }
      stage(plant, reference, t + node[s] * h, s);
      plant.add_to(account, v_, torque_, weight[s] * h / 6.0);
    }
    v += (h / 6.0) * (dv_[0] + 2.0 * dv_[1] + 2.0 * dv_[2] + dv_[3]);
    xi_ = (h / 6.0) * (dxi_[0] + 2.0 * dxi_[1] + 2.0 * dxi_[2] + dxi_[3]);
    retract(q, xi_, q);
  }

  std::map<std::string, double> counters() const { return {}; }

 private:
  void stage(PlantT& plant, Reference& reference, double t, int s) {
    reference.at(t, q_ref_, v_ref_);
    plant.servo_torque(q_, v_, q_ref_, v_ref_, torque_);
    plant.acceleration(v_, torque_, dv_[s]);
    chart_rate(xi_, v_, dxi_[s]);
  }

  VectorXd q_, v_, xi_, torque_, q_ref_, v_ref_;
  std::array<VectorXd, 4> dxi_, dv_;
};

}  // namespace hexapod
