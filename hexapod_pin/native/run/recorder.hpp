// Samples of a run, one row-major table per quantity. A foot force is the law's at the sample's state; a
// foot impulse is the force's integral over the sampling interval that ends there: momentum adds up.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "plant/plant.hpp"
#include "run/sample_tables.hpp"
#include "run/winding_heat.hpp"

namespace hexapod {

// Errors of a sample: of the trunk's place [m] and attitude [rad], the largest of a joint angle [rad], of a
// joint's torque [N m] and of a foot's force [N].
using SampleError = Eigen::Matrix<double, 5, 1>;

class Recorder {
 public:
  // `omitted`: names of tables that are not kept; `estimates`: whether errors are; `heat`: whether currents and
  // temperatures of motors are.
  template <class PlantT>
  Recorder(const PlantT& plant, const std::vector<std::string>& omitted, bool estimates, bool heat)
      : tables_(kept(layout(plant.tree, plant.mounts.size(), estimates, heat), omitted)) {}

  SampleTables& tables() { return tables_; }

  template <class PlantT>
  void sample(const PlantT& plant, double t, const VectorXd& q, const VectorXd& v,
              const VectorXd& torque, const VectorXd& q_ref, const VectorXd& v_ref,
              const EnergyLedger& ledger, double interval, const SampleError& error,
              const WindingHeat& heat) {
    tables_.begin_row();
    tables_[kTime].append(t);
    tables_[kQ].append(q);
    tables_[kV].append(v);
    tables_[kTorque].append(torque);
    tables_[kQRef].append(q_ref);
    tables_[kVRef].append(v_ref);
    sample_feet(plant, q, ledger, interval);
    const Vec3 com = q.head<3>() + plant.center_of_mass();
    tables_[kCom].append(com);
    tables_[kKinetic].append(plant.kinetic_energy(v));
    tables_[kPotential].append(-plant.dynamics.total_mass() * plant.dynamics.gravity().dot(com));
    double normal = 0.0, bristle = 0.0;
    for (const auto& foot : plant.feet) {
      normal += plant.stored_normal(foot);
      bristle += plant.stored_bristle(foot);
    }
    const double stops = plant.stored_in_stops(q);
    if (tables_.rows() == 1)
      first_normal_ = normal, first_bristle_ = bristle, first_stops_ = stops;
    tables_[kElastic].append(normal + bristle + stops);
    tables_[kServoWork].append(ledger.servo);
    tables_[kJointDampingLoss].append(ledger.joint_damping + ledger.stops - (stops - first_stops_));
    tables_[kNormalLoss].append(ledger.normal - (normal - first_normal_));
    tables_[kFrictionLoss].append(ledger.friction - (bristle - first_bristle_));
    tables_[kPushWork].append(ledger.push);
    tables_[kError].append(error);
    tables_[kCurrent].append(heat.current());
    tables_[kTemperature].append(heat.temperature());
  }

 private:
  enum Quantity {
    kTime, kQ, kV, kTorque, kQRef, kVRef, kFootPosition, kFootForce, kFootImpulse, kFootNormal, kFootGap,
    kCom, kKinetic, kPotential, kElastic, kServoWork, kJointDampingLoss, kNormalLoss, kFrictionLoss,
    kPushWork, kError, kSlipSpeed, kCurrent, kTemperature
  };

  // in the order of Quantity
  static std::vector<SampleTable> layout(const Tree& tree, std::size_t feet, bool estimates,
                                         bool heat) {
    const std::size_t nq = tree.nq, nv = tree.nv, n = nv - 6;
    return {{"time", 1}, {"q", nq}, {"v", nv}, {"torque", n}, {"q_ref", n}, {"v_ref", n},
            {"foot_position", 3 * feet}, {"foot_force", 3 * feet}, {"foot_impulse", 3 * feet}, {"foot_normal", 3 * feet},
            {"foot_gap", feet}, {"com", 3}, {"kinetic", 1}, {"potential", 1}, {"elastic", 1},
            {"servo_work", 1}, {"joint_damping_loss", 1}, {"normal_loss", 1},
            {"friction_loss", 1}, {"push_work", 1},
            {"error", estimates ? std::size_t(SampleError::SizeAtCompileTime) : 0},
            {"slip_speed", feet}, {"current", heat ? n : 0}, {"temperature", heat ? n : 0}};
  }

  static std::vector<SampleTable> kept(std::vector<SampleTable> tables,
                                       const std::vector<std::string>& omitted) {
    for (SampleTable& table : tables)
      if (std::find(omitted.begin(), omitted.end(), table.name) != omitted.end()) table.width = 0;
    return tables;
  }

  template <class PlantT>
  void sample_feet(const PlantT& plant, const VectorXd& q, const EnergyLedger& ledger,
                   double interval) {
    for (std::size_t f = 0; f < plant.mounts.size(); ++f) {
      std::size_t nearest = f * plant.per_foot;
      Vec3 force = Vec3::Zero(), impulse = Vec3::Zero(), pushed = Vec3::Zero();
      double most = 0.0, slip = 0.0;  // of two contacts the more loaded one slips
      for (std::size_t i = f * plant.per_foot; i < (f + 1) * plant.per_foot; ++i) {
        if (plant.feet[i].ground.gap < plant.feet[nearest].ground.gap) nearest = i;
        const Vec3 part = plant.law_force(plant.feet[i]);
        force += part;
        if (interval > 0.0) impulse += ledger.impulse[i];
        const Vec3& up = plant.feet[i].ground.normal;
        const double normal = up.dot(part);
        pushed += normal * up;
        if (normal > most) most = normal, slip = in_plane(up, plant.feet[i].velocity).norm();
      }
      tables_[kFootPosition].append(Vec3(q.head<3>() + plant.feet[nearest].center));
      tables_[kFootForce].append(force);
      tables_[kFootImpulse].append(impulse);
      // two contacts push along the sum of their normal forces
      const bool both = plant.per_foot > 1 && pushed.norm() > 0.0;
      tables_[kFootNormal].append(both ? Vec3(pushed.normalized()) : plant.feet[nearest].ground.normal);
      tables_[kFootGap].append(plant.feet[nearest].ground.gap);
      tables_[kSlipSpeed].append(slip);
    }
  }

  SampleTables tables_;
  double first_normal_ = 0.0, first_bristle_ = 0.0, first_stops_ = 0.0;
};

}  // namespace hexapod
