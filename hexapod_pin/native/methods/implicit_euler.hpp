// Linearly implicit Euler at a fixed step: v += h a, q moves with the new v. Order 1.
#pragma once

#include <map>
#include <string>

#include "methods/linear_step.hpp"
#include "plant/chart.hpp"

namespace hexapod {

template <class PlantT>
class ImplicitEuler {
 public:
  static constexpr bool kForcesAtStepEnd = true;      // contact forces belong to the end of the step
  static constexpr bool kNeedsSeparatedFeet = false;  // feet out of contact need no Jacobian

  explicit ImplicitEuler(const PlantT& plant) : linear_(plant), xi_(plant.tree.nv) {}

  // One step from the evaluated state. Servos and feet act at the end of the step. A joint whose
  // torque would pass its limit there gets the limit as a constant torque; a foot whose normal force
  // would be negative is released; a foot whose slip would reverse gets the secant of its friction law,
  // because past the peak the tangent vanishes and the slip would alternate; a joint that dry friction
  // would turn back is stuck, and slides where it would have to hold more; and the step is solved again.
  void step(PlantT& plant, Reference& reference, double t, double h, VectorXd& q, VectorXd& v,
            EnergyLedger& ledger) {
    const VectorXd& joints = joints_ = q.tail(plant.joints());
    linear_.begin(plant, reference, t + h, v);
    const int most = plant.dry ? kMaxPassesWithFriction : kMaxPasses;
    for (int pass = 0;; ++pass) {
      linear_.solve(plant, h, joints, v);
      linear_.find_end(plant, h);
      const bool saturated = linear_.find_saturated(plant, h, joints);
      const bool changed = linear_.find_changed_contacts(plant);
      const bool stuck_or_loose = linear_.find_changed_friction(plant, h, joints);
      if (!(saturated || changed || stuck_or_loose) || pass == most) break;
      ++solved_again_;
    }
    linear_.accumulate(plant, h, joints, ledger);
    linear_.count(plant, h);
    if (plant.law.friction.has_bristle()) update_bristles(plant, h);
    v = linear_.v_end();
    xi_ = h * v;
    retract(q, xi_, q);
    if constexpr (PlantT::kPrescribed) q.tail(plant.joints()) = linear_.set_points();
  }

  std::map<std::string, double> counters() const { return {{"solved_again", double(solved_again_)}}; }

 private:
  static constexpr int kMaxPasses = 8, kMaxPassesWithFriction = 40;

  void update_bristles(PlantT& plant, double h) const {
    for (std::size_t i = 0; i < plant.feet.size(); ++i) {
      auto& foot = plant.feet[i];
      if (linear_.has_force(i))
        update_bristle(plant.law.friction, foot.mu_scale, foot.ground.normal, linear_.force(i), h,
                       foot.memory);
    }
  }

  LinearStep<PlantT> linear_;
  VectorXd xi_, joints_;
  long solved_again_ = 0;
};

}  // namespace hexapod
