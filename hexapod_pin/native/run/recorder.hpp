// Samples of a run, one growing row-major table per quantity. A foot force is the mean over the
// sampling interval that ends at its sample (impulse over time: momentum adds up exactly); the first
// is the law's.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "plant/plant.hpp"

namespace hexapod {

struct Channel {
  std::size_t width = 1;
  std::vector<double> values;

  template <class Vector>
  void append(const Vector& v) {
    values.insert(values.end(), v.data(), v.data() + v.size());
  }
  void append(double x) { values.push_back(x); }
};

class Recorder {
 public:
  template <class PlantT>
  explicit Recorder(const PlantT& plant) {
    const std::size_t n = plant.joints(), feet = plant.mounts.size();
    q_.width = plant.tree.nq;
    v_.width = plant.tree.nv;
    torque_.width = q_ref_.width = v_ref_.width = n;
    foot_position_.width = foot_force_.width = foot_normal_.width = 3 * feet;
    foot_gap_.width = feet;
    com_.width = 3;
    was_active_.assign(plant.feet.size(), true);
  }

  template <class PlantT>
  void sample(const PlantT& plant, double t, const VectorXd& q, const VectorXd& v,
              const VectorXd& torque, const VectorXd& q_ref, const VectorXd& v_ref,
              const EnergyLedger& ledger, double interval) {
    time_.append(t);
    q_.append(q);
    v_.append(v);
    torque_.append(torque);
    q_ref_.append(q_ref);
    v_ref_.append(v_ref);
    sample_feet(plant, q, ledger, interval);
    const Vec3 com = q.head<3>() + plant.center_of_mass();
    com_.append(com);
    kinetic_.append(plant.kinetic_energy(v));
    potential_.append(-plant.dynamics.total_mass() * plant.dynamics.gravity().dot(com));
    double normal = 0.0, bristle = 0.0;
    for (const auto& foot : plant.feet) {
      normal += plant.stored_normal(foot);
      bristle += plant.stored_bristle(foot);
    }
    const double stops = plant.stored_in_stops(q);
    if (time_.values.size() == 1)
      first_normal_ = normal, first_bristle_ = bristle, first_stops_ = stops;
    elastic_.append(normal + bristle + stops);
    servo_work_.append(ledger.servo);
    joint_damping_loss_.append(ledger.joint_damping + ledger.stops - (stops - first_stops_));
    normal_loss_.append(ledger.normal - (normal - first_normal_));
    friction_loss_.append(ledger.friction - (bristle - first_bristle_));
  }

  std::vector<std::pair<std::string, const Channel*>> channels() const {
    return {{"time", &time_}, {"q", &q_}, {"v", &v_}, {"torque", &torque_}, {"q_ref", &q_ref_},
            {"v_ref", &v_ref_}, {"foot_position", &foot_position_}, {"foot_force", &foot_force_},
            {"foot_normal", &foot_normal_}, {"foot_gap", &foot_gap_}, {"com", &com_},
            {"kinetic", &kinetic_}, {"potential", &potential_}, {"elastic", &elastic_},
            {"servo_work", &servo_work_}, {"joint_damping_loss", &joint_damping_loss_},
            {"normal_loss", &normal_loss_}, {"friction_loss", &friction_loss_}};
  }

 private:
  // Share of the weight [-] below which the mean force of a foot that is in the air at both ends of an
  // interval is taken as zero: what a multistep or extrapolated impulse may leave.
  static constexpr double kResidualForceShare = 1e-3;

  template <class PlantT>
  void sample_feet(const PlantT& plant, const VectorXd& q, const EnergyLedger& ledger,
                   double interval) {
    const double weight = plant.dynamics.total_mass() * plant.dynamics.gravity().norm();
    for (std::size_t f = 0; f < plant.mounts.size(); ++f) {
      std::size_t nearest = f * plant.per_foot;
      Vec3 force = Vec3::Zero(), pushed = Vec3::Zero();
      for (std::size_t i = f * plant.per_foot; i < (f + 1) * plant.per_foot; ++i) {
        if (plant.feet[i].ground.gap < plant.feet[nearest].ground.gap) nearest = i;
        Vec3 part = interval > 0.0 ? Vec3(ledger.impulse[i] / interval) : plant.feet[i].contact.force;
        const bool free = !plant.feet[i].active && !was_active_[i];
        if (free && part.norm() < kResidualForceShare * weight) part.setZero();
        was_active_[i] = plant.feet[i].active;
        force += part;
        pushed += plant.feet[i].ground.normal.dot(part) * plant.feet[i].ground.normal;
      }
      foot_position_.append(Vec3(q.head<3>() + plant.feet[nearest].center));
      foot_force_.append(force);
      // two contacts push along the sum of their normal forces
      const bool both = plant.per_foot > 1 && pushed.norm() > 0.0;
      foot_normal_.append(both ? Vec3(pushed.normalized()) : plant.feet[nearest].ground.normal);
      foot_gap_.append(plant.feet[nearest].ground.gap);
    }
  }

  Channel time_, q_, v_, torque_, q_ref_, v_ref_, foot_position_, foot_force_, foot_normal_,
      foot_gap_, com_, kinetic_, potential_, elastic_, servo_work_, joint_damping_loss_,
      normal_loss_, friction_loss_;
  std::vector<char> was_active_;  // contacts, at the sample before
  double first_normal_ = 0.0, first_bristle_ = 0.0, first_stops_ = 0.0;
};

}  // namespace hexapod
