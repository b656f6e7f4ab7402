// A scene as an ordinary differential equation y' = f(t, y) in the chart of a configuration q0:
// y = (xi, v, z, w): chart coordinates, velocity, bristles of the contacts, works and impulses. Where the
// joints follow a given motion their entries of xi and v are 0: they are known.
#pragma once

#include "methods/error_control.hpp"
#include "plant/plant.hpp"
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
  ChartFlow(PlantT& plant, Reference& reference);

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
  void begin(const VectorXd& q, const VectorXd& velocity, VectorXd& y);

  // Configuration and velocity at y.
  void state(double t, const VectorXd& y, VectorXd& q, VectorXd& velocity);

  // The entries of v and of xi in y, or in a rate of y.
  void put_velocity(const VectorXd& velocity, VectorXd& y) const;
  void put_chart(const VectorXd& coordinates, VectorXd& y) const;

  void evaluate(double t, const VectorXd& y);

  // Saves the evaluated state y0 while others are evaluated.
  void save_evaluation() { plant.save_evaluation(); }
  void restore_evaluation(double t, const VectorXd& y0);

  // y' at the state last evaluated, y and t as then
  void rate_here(double t, const VectorXd& y, VectorXd& dy);

  void rate(double t, const VectorXd& y, VectorXd& dy) {
    evaluate(t, y);
    rate_here(t, y, dy);
  }

  // y becomes the run's state: configuration and velocity out, contact memories updated, works added to
  // the ledger. The plant must have been evaluated at y.
  void accept(const VectorXd& y, VectorXd& q, VectorXd& velocity, EnergyLedger& ledger);

  // The contacts remember their bristles; one that is not frozen slides where the force last evaluated is
  // at the cone.
  void update_bristles(const VectorXd& y);

  // Angle of a joint at y, rad.
  double joint_angle(const VectorXd& y, int joint) const { return q0_[7 + joint] + y[6 + joint]; }

  // of the state last evaluated
  const VectorXd& coordinates() const { return xi_; }  // in the chart
  const VectorXd& position() const { return q_; }
  const VectorXd& velocity() const { return v_; }
  auto joints() const { return q_.tail(q_.size() - 7); }

  // Servo demands [N m] there for the set-points of time t.
  void servo_demand(double t, VectorXd& demand);

  // Motor torques of a prescribed motion at the state last evaluated, at time t, N m.
  const VectorXd& reaction_torque(double t);

  // Accelerations of the joints there, of a prescribed motion, rad/s^2.
  const VectorXd& joint_acceleration() const { return set_points_.a; }

  double norm_of(const VectorXd& error, const ErrorNorm& norm, double h) const;

  // The coordinate of the velocity in which an error weighs most.
  long worst_coordinate(const VectorXd& error, const ErrorNorm& norm, double h) const;

  Vec3 bristle(const VectorXd& y, int contact) const {
    return y.template segment<3>(2 * nv + 3 * contact);
  }

  PlantT& plant;
  Reference& reference;
  InsideStep* inside = nullptr;
  const int nv, nz, nw;

 private:
  // v' and the motors' torques at the state last evaluated.
  void find_acceleration(double t);

  EnergyLedger ledger_;
  VectorXd q0_, q_, xi_, v_, rate_, torque_, demand_;
  SetPoints set_points_;
};

}  // namespace hexapod
