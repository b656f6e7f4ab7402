// A scene as an ordinary differential equation y' = f(t, y) in the chart of a configuration q0:
// y = (xi, v, z, w): chart coordinates, velocity, bristles of the contacts, works and impulses. Where the
// joints follow a given motion their entries of xi and v are 0: they are known.
#pragma once

#include "methods/error_control.hpp"
#include "plant/chart.hpp"
#include "plant/plant.hpp"
#include "plant/reaction.hpp"
#include "plant/reference.hpp"

namespace hexapod {

// Told of the states that a method passes through within a step.
class InsideStep {
 public:
  virtual ~InsideStep() = default;
  virtual void passed(double t, const VectorXd& y) = 0;
};

template <class PlantT>
class ChartFlow {
 public:
  ChartFlow(PlantT& plant, Reference& reference)
      : plant(plant), reference(reference), nv(plant.tree.nv),
        nz(plant.law.friction.has_bristle() ? 3 * int(plant.feet.size()) : 0),
        nw(EnergyLedger::size(plant.feet.size())), ledger_(plant.feet.size()), q_(plant.tree.nq),
        xi_(nv), v_(nv), rate_(nv), torque_(plant.joints()), demand_(plant.joints()),
        set_points_(plant.joints()) {}

  int size() const { return 2 * nv + nz + nw; }

  auto xi(const VectorXd& y) const { return y.head(nv); }
  auto v(const VectorXd& y) const { return y.segment(nv, nv); }
  auto z(const VectorXd& y) const { return y.segment(2 * nv, nz); }
  auto w(const VectorXd& y) const { return y.tail(nw); }
  auto xi(VectorXd& y) const { return y.head(nv); }
  auto v(VectorXd& y) const { return y.segment(nv, nv); }
  auto z(VectorXd& y) const { return y.segment(2 * nv, nz); }
  auto w(VectorXd& y) const { return y.tail(nw); }

  // y at a configuration, which becomes the chart's origin; works start at 0. Where the plant has
  // been evaluated there, rate_here may follow.
  void begin(const VectorXd& q, const VectorXd& velocity, VectorXd& y) {
    q0_ = q_ = q;
    v_ = velocity;
    y.setZero(size());
    put_velocity(velocity, y);
    for (int i = 0; i < nz / 3; ++i) y.template segment<3>(2 * nv + 3 * i) = plant.feet[i].memory.stretch;
  }

  // Configuration and velocity at y.
  void state(double t, const VectorXd& y, VectorXd& q, VectorXd& velocity) {
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

  // The entries of v and of xi in y, or in a rate of y.
  void put_velocity(const VectorXd& velocity, VectorXd& y) const {
    v(y) = velocity;
    if constexpr (PlantT::kPrescribed) v(y).tail(plant.joints()).setZero();
  }
  void put_chart(const VectorXd& coordinates, VectorXd& y) const {
    xi(y) = coordinates;
    if constexpr (PlantT::kPrescribed) xi(y).tail(plant.joints()).setZero();
  }

  void evaluate(double t, const VectorXd& y) {
    state(t, y, q_, v_);
    for (int i = 0; i < nz / 3; ++i) plant.feet[i].memory.stretch = bristle(y, i);
    plant.evaluate(t, q_, v_, 0.0);
  }

  // Saves the evaluated state y0 while others are evaluated.
  void save_evaluation() { plant.save_evaluation(); }
  void restore_evaluation(double t, const VectorXd& y0) {
    plant.restore_evaluation();
    state(t, y0, q_, v_);
    for (int i = 0; i < nz / 3; ++i) plant.feet[i].memory.stretch = bristle(y0, i);
  }

  // y' at the state last evaluated, y and t as then
  void rate_here(double t, const VectorXd& y, VectorXd& dy) {
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

  void rate(double t, const VectorXd& y, VectorXd& dy) {
    evaluate(t, y);
    rate_here(t, y, dy);
  }

  // y becomes the run's state: configuration and velocity out, contact memories updated, works added to
  // the ledger. The plant must have been evaluated at y.
  void accept(const VectorXd& y, VectorXd& q, VectorXd& velocity, EnergyLedger& ledger) {
    q = q_;
    velocity = v_;
    ledger.add(w(y));
    update_bristles(y);
    plant.update_memories();
  }

  // The contacts remember their bristles; one that is not frozen slides where the force last evaluated is
  // at the cone.
  void update_bristles(const VectorXd& y) {
    for (int i = 0; i < nz / 3; ++i) {
      auto& foot = plant.feet[i];
      foot.memory.stretch = bristle(y, i);
      if (foot.active && !plant.pieces_frozen)
        foot.memory.sliding = at_cone(plant.law.friction, foot.mu_scale, foot.ground.normal,
                                      foot.contact.force, foot.memory.sliding);
    }
  }

  // Angle of a joint at y, rad.
  double joint_angle(const VectorXd& y, int joint) const { return q0_[7 + joint] + y[6 + joint]; }

  // of the state last evaluated
  const VectorXd& position() const { return q_; }
  const VectorXd& velocity() const { return v_; }
  auto joints() const { return q_.tail(q_.size() - 7); }

  // Servo demands [N m] there for the set-points of time t.
  void servo_demand(double t, VectorXd& demand) {
    set_points_.take(reference, t);
    plant.servo_demand(q_, v_, set_points_, demand);
  }

  // Motor torques of a prescribed motion at the state last evaluated, at time t, N m.
  const VectorXd& reaction_torque(double t) {
    find_acceleration(t);
    return torque_;
  }

  // Accelerations of the joints there, of a prescribed motion, rad/s^2.
  const VectorXd& joint_acceleration() const { return set_points_.a; }

  double norm_of(const VectorXd& error, const ErrorNorm& norm, double h) const {
    return norm(xi(error), v(error), z(error), h);
  }

  // The coordinate of the velocity in which an error weighs most.
  long worst_coordinate(const VectorXd& error, const ErrorNorm& norm, double h) const {
    if (error.size() != size()) return -1;
    Eigen::Index worst = -1;
    xi(error).cwiseAbs().cwiseMax(norm.weight(h) * v(error).cwiseAbs()).maxCoeff(&worst);
    return long(worst);
  }

  Vec3 bristle(const VectorXd& y, int contact) const {
    return y.template segment<3>(2 * nv + 3 * contact);
  }

  PlantT& plant;
  Reference& reference;
  InsideStep* inside = nullptr;
  const int nv, nz, nw;

 private:
  // v' and the motors' torques at the state last evaluated.
  void find_acceleration(double t) {
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

  EnergyLedger ledger_;
  VectorXd q0_, q_, xi_, v_, rate_, torque_, demand_;
  SetPoints set_points_;
};

}  // namespace hexapod
