// Joints that follow a given motion: the base's acceleration, the torques that the motion takes (inverse
// dynamics with the contact forces, S2 appendix eq. 1 solved for the torques), and their work.
#pragma once

#include "plant/plant.hpp"

namespace hexapod {

// v' at the evaluated state where the joints have the given accelerations (n).
template <class PlantT>
void prescribed_acceleration(PlantT& plant, const VectorXd& joint_acceleration, VectorXd& out) {
  out = -plant.bias();
  for (const auto& foot : plant.feet)
    if (foot.active) out.template head<6>().noalias() += foot.jb.transpose() * foot.contact.force;
  out.tail(plant.joints()) = joint_acceleration;
  plant.system.load(plant.mass_upper());
  plant.system.factor();
  plant.system.solve(out);
}

// Torques of the motors (n) [N m] that give these accelerations (nv) at these rates (nv) under the contact
// forces `force(i)`; and the external ones on the joints (n), where a gear's friction depends on them.
template <class PlantT, class Force>
void reaction_torque(const PlantT& plant, const VectorXd& v, const VectorXd& acceleration,
                     const Force& force, VectorXd& torque, VectorXd& external) {
  for (int j = 0; j < plant.joints(); ++j)
    torque[j] = plant.inertial_torque(j, acceleration) + plant.bias()[6 + j];
  for (std::size_t i = 0; i < plant.feet.size(); ++i) {
    if (!plant.feet[i].active) continue;
    const Vec3 f = force(i);
    for (std::size_t k = 0; k < plant.columns(i).size(); ++k)
      torque[Tree::column(plant.columns(i)[k]) - 6] -= plant.feet[i].jl.col(k).dot(f);
  }
  if (plant.needs_external) plant.find_external(force, external);
  for (int j = 0; j < plant.joints(); ++j)
    torque[j] += plant.drive.resistance_to(j, torque[j], v[6 + j], plant.needs_external ? external[j] : 0.0);
}

// The same under the forces at the evaluated state.
template <class PlantT>
void reaction_torque(const PlantT& plant, const VectorXd& v, const VectorXd& acceleration,
                     VectorXd& torque) {
  const auto own = [&plant](std::size_t i) { return plant.feet[i].contact.force; };
  VectorXd external;
  reaction_torque(plant, v, acceleration, own, torque, external);
}

// Adds the work of these torques (n) at these rates (nv) over a time dt, and what friction takes of it.
template <class PlantT>
void add_reaction_work(const PlantT& plant, const VectorXd& v, const VectorXd& torque,
                       const VectorXd& external, double dt, EnergyLedger& ledger) {
  for (int j = 0; j < plant.joints(); ++j) {
    const double rate = v[6 + j];
    ledger.servo += dt * torque[j] * rate;
    const double load = plant.needs_external ? external[j] : 0.0;
    ledger.joint_damping += dt * plant.drive.resistance(j, torque[j], rate, load) * rate;
  }
}

// What joint rates (n) give a contact's velocity.
template <class PlantT>
Vec3 leg_velocity(const PlantT& plant, std::size_t contact, const VectorXd& rates) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < plant.columns(contact).size(); ++k)
    sum += plant.feet[contact].jl.col(k) * rates[Tree::column(plant.columns(contact)[k]) - 6];
  return sum;
}

}  // namespace hexapod
