#include "methods/chart_flow.hpp"

#include "plant/arrow.hpp"
#include "plant/chart.hpp"
#include "plant/dense.hpp"
#include "plant/prescribed_system.hpp"
#include "plant/reaction.hpp"

namespace hexapod {

template <class PlantT>
ChartFlow<PlantT>::ChartFlow(PlantT& plant, Reference& reference)
    : plant(plant), reference(reference), nv(plant.tree.nv), nz(plant.law.friction.has_bristle() ? 3 *
      int(plant.feet.size()) : 0), nw(EnergyLedger::size(plant.feet.size())), ledger_(plant.feet.size()),
      q_(plant.tree.nq), xi_(nv), v_(nv), rate_(nv), torque_(plant.joints()), demand_(plant.joints()),
      set_points_(plant.joints()) {}

template <class PlantT>
void ChartFlow<PlantT>::begin(const VectorXd& q, const VectorXd& velocity, VectorXd& y) {
  q0_ = q_ = q;
  v_ = velocity;
  y.setZero(size());
  put_velocity(velocity, y);
  for (int i = 0; i < nz / 3; ++i) y.template segment<3>(2 * nv + 3 * i) = plant.feet[i].memory.stretch;
}

template <class PlantT>
void ChartFlow<PlantT>::state(double t, const VectorXd& y, VectorXd& q, VectorXd& velocity) {
  xi_ = xi(y);
  q.resize(q0_.size());
  retract(q0_, xi_, q);
  velocity = v(y);
  if constexpr (PlantT::kPrescribed) {
    set_points_.take_motion(reference, t);
    q.tail(plant.joints()) = set_points_.q;
    velocity.tail(plant.joints()) = set_points_.v;
  }
}

template <class PlantT>
void ChartFlow<PlantT>::put_velocity(const VectorXd& velocity, VectorXd& y) const {
  v(y) = velocity;
  if constexpr (PlantT::kPrescribed) v(y).tail(plant.joints()).setZero();
}

template <class PlantT>
void ChartFlow<PlantT>::put_chart(const VectorXd& coordinates, VectorXd& y) const {
  xi(y) = coordinates;
  if constexpr (PlantT::kPrescribed) xi(y).tail(plant.joints()).setZero();
}

template <class PlantT>
void ChartFlow<PlantT>::evaluate(double t, const VectorXd& y) {
  state(t, y, q_, v_);
  for (int i = 0; i < nz / 3; ++i) plant.feet[i].memory.stretch = bristle(y, i);
  plant.evaluate(t, q_, v_, 0.0);
}

template <class PlantT>
void ChartFlow<PlantT>::restore_evaluation(double t, const VectorXd& y0) {
  plant.restore_evaluation();
  state(t, y0, q_, v_);
  for (int i = 0; i < nz / 3; ++i) plant.feet[i].memory.stretch = bristle(y0, i);
}

template <class PlantT>
void ChartFlow<PlantT>::rate_here(double t, const VectorXd& y, VectorXd& dy) {
  dy.resize(size());
  find_acceleration(t);
  put_velocity(rate_, dy);
  xi_ = xi(y);
  chart_rate(xi_, v_, rate_);
  put_chart(rate_, dy);
  for (int i = 0; i < nz / 3; ++i) {
    const auto& foot = plant.feet[i];
    dy.template segment<3>(2 * nv + 3 * i) =
        stretch_rate(plant.law.friction, foot.ground.normal, foot.contact.force, bristle(y, i));
  }
  ledger_.clear();
  plant.accumulate(ledger_, v_, torque_, 1.0);
  ledger_.write(w(dy));
}

template <class PlantT>
void ChartFlow<PlantT>::accept(const VectorXd& y, VectorXd& q, VectorXd& velocity, EnergyLedger& ledger) {
  q = q_;
  velocity = v_;
  ledger.add(w(y));
  update_bristles(y);
  plant.update_memories();
}

template <class PlantT>
void ChartFlow<PlantT>::update_bristles(const VectorXd& y) {
  for (int i = 0; i < nz / 3; ++i) {
    auto& foot = plant.feet[i];
    foot.memory.stretch = bristle(y, i);
    if (foot.active && !plant.pieces_frozen)
      foot.memory.sliding = at_cone(plant.law.friction, foot.mu_scale, foot.ground.normal,
                                    foot.contact.force, foot.memory.sliding);
  }
}

template <class PlantT>
void ChartFlow<PlantT>::servo_demand(double t, VectorXd& demand) {
  set_points_.take(reference, t);
  plant.servo_demand(q_, v_, set_points_, demand);
}

template <class PlantT>
const VectorXd& ChartFlow<PlantT>::reaction_torque(double t) {
  find_acceleration(t);
  return torque_;
}

template <class PlantT>
long ChartFlow<PlantT>::worst_coordinate(const VectorXd& error, const ErrorNorm& norm, double h) const {
  if (error.size() != size()) return -1;
  Eigen::Index worst = -1;
  xi(error).cwiseAbs().cwiseMax(norm.weight(h) * v(error).cwiseAbs()).maxCoeff(&worst);
  return long(worst);
}

template <class PlantT>
double ChartFlow<PlantT>::norm_of(const VectorXd& error, const ErrorNorm& norm, double h) const {
  return norm(xi(error), v(error), z(error), h);
}

template <class PlantT>
inline void ChartFlow<PlantT>::find_acceleration(double t) {
  if constexpr (PlantT::kPrescribed) {
    set_points_.take_motion(reference, t);
    prescribed_acceleration(plant, set_points_.a, rate_);
    hexapod::reaction_torque(plant, v_, rate_, torque_);
  } else {
    servo_demand(t, demand_);
    plant.motor_torque(v_, demand_, torque_);
    plant.acceleration(v_, torque_, rate_);
  }
}

template class ChartFlow<Plant<ArrowSystem>>;
template class ChartFlow<Plant<DenseSystem>>;
template class ChartFlow<Plant<PrescribedSystem>>;

}  // namespace hexapod
