// Robust fixed step: servos, feet and friction solved together at the end of the step as nonlinear
// laws, by a Newton on the six base velocities with every foot solved exactly inside. Order 1,
// stable and dissipative at any stiffness: K, slip slope and gains set no limit on the step.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "plant/plant.hpp"
#include "robust/flat_newton.hpp"
#include "robust/joint_drives.hpp"
#include "robust/leg_elimination.hpp"
#include "robust/nested_newton.hpp"

namespace hexapod {

// The unknown is the velocity v_a used over the step, v_a = v + alpha (v_end - v): q moves with v_a,
// servos and laws see it. kFlatFirst: try the flat Newton before the nested one.
template <class PlantT, bool kFlatFirst>
class RobustStep {
 public:
  static constexpr bool kAtEnd = true;
  static constexpr bool kLooksAhead = true;

  explicit RobustStep(const PlantT& plant)
      : legs_(plant.joints() / 3), drives_(plant.joints()), used_(plant.joints() / 3),
        impulse_(plant.joints() / 3), right_(plant.tree.nv), dv_(plant.tree.nv),
        mean_(plant.tree.nv), xi_(plant.tree.nv) {}

  // One step from the evaluated state; in halves where something turns so fast that the mass matrix
  // and the Coriolis forces at the start would not do for the whole step.
  void step(PlantT& plant, Reference& reference, double t, double h, VectorXd& q, VectorXd& v,
            EnergyLedger& ledger) {
    go(plant, reference, t, h, q, v, ledger, kMostHalvings);
  }

  std::map<std::string, double> counters() const {
    return {{"outer_iterations", double(base_.nested.iterations + any_.nested.iterations)},
            {"convex_finishes", double(base_.nested.convex_finishes + any_.nested.convex_finishes)},
            {"flat_sweeps", double(base_.flat.sweeps + any_.flat.sweeps)},
            {"flat_hits", double(base_.flat.hits + any_.flat.hits)},
            {"solved_again", double(solved_again_)},
            {"halved", double(halved_)},
            {"largest_rate_step", largest_rate_step_},
            {"contact_injection", injection_},
            {"deepest_first_touch", deepest_first_touch_}};
  }

 private:
  static constexpr double kAlpha = 0.75;
  static constexpr double kMostTurn = 0.05;  // rad
  static constexpr int kMostPasses = 8, kMostHalvings = 5;

  template <int N>
  struct Solver {
    ImpulseProblem<N> problem;
    FlatNewton<N> flat;
    NestedNewton<N> nested;
  };

  static double largest_rate(const VectorXd& v) { return v.tail(v.size() - 3).cwiseAbs().maxCoeff(); }

  void go(PlantT& plant, Reference& reference, double t, double h, VectorXd& q, VectorXd& v,
          EnergyLedger& ledger, int halvings) {
    if (halvings == 0 || h * largest_rate(v) <= kMostTurn)
      return advance(plant, reference, t, h, q, v, ledger);
    ++halved_;
    go(plant, reference, t, 0.5 * h, q, v, ledger, halvings - 1);
    plant.evaluate(t + 0.5 * h, q, v, 0.5 * h);
    plant.settle_memory();
    go(plant, reference, t + 0.5 * h, 0.5 * h, q, v, ledger, halvings - 1);
  }

  void advance(PlantT& plant, Reference& reference, double t, double h, VectorXd& q, VectorXd& v,
               EnergyLedger& ledger) {
    drives_.begin(plant.servo, plant.stops, reference, t + h, h, q.tail(plant.joints()));
    find_contacts(plant, t, h, q);
    if (legs_.keeps_any()) finish(plant, h, v, any_, ledger);
    else finish(plant, h, v, base_, ledger);
    move(h, q, v);
  }

  template <int N>
  void finish(PlantT& plant, double h, const VectorXd& v, Solver<N>& solver, EnergyLedger& ledger) {
    for (int pass = 0;; ++pass) {
      load(plant, h, v);
      solve(plant, h, solver);
      mean_ = v + dv_;
      if (!drives_.find_changes(mean_.tail(plant.joints())) || pass == kMostPasses) break;
      ++solved_again_;
    }
    drives_.keep_book(mean_.tail(plant.joints()), ledger);
    for (const auto& c : solver.problem.contacts) settle(plant, h, c, ledger);
  }

  // Contacts that can press in this step; a leg with two of them keeps its joints in the system.
  void find_contacts(PlantT& plant, double t, double h, const VectorXd& q) {
    drift_ = Vec3(0.0, 0.0, plant.terrain.lift(t) - plant.terrain.lift(t + h)) / h +
             plant.ground_velocity;  // the ground's mean velocity instead of that at t
    live_.clear();
    legs_.keep_none();
    std::fill(used_.begin(), used_.end(), false);
    for (std::size_t i = 0; i < plant.feet.size(); ++i) {
      auto& foot = plant.feet[i];
      if (!foot.active && foot.ground.gap >= kFarAway) continue;
      if (!foot.active && foot.ground.gap > h * (2.0 + 3.0 * foot.velocity.norm())) continue;
      if (!foot.active && !plant.terrain.patches.empty())
        std::tie(foot.mu_scale, foot.k_scale) =
            plant.terrain.factors(q[0] + foot.center.x(), q[1] + foot.center.y());
      live_.push_back(i);
      const int leg = leg_of(plant, i);
      if (leg < 0) continue;
      if (used_[leg]) legs_.keep(leg);
      used_[leg] = true;
    }
  }

  static int leg_of(const PlantT& plant, std::size_t contact) {
    const std::size_t joint = plant.mounts[plant.foot_of(contact)].joint;
    return joint < 2 ? -1 : int(joint - 2) / 3;
  }

  // (M + w D + w h K) dv = r with w = alpha h; impulses are alpha times those of the step. Of the bias
  // the body-axes term omega x v_lin is left out, `move` turns the velocity instead; omega x (angular
  // momentum L) is taken as -L x omega_a, which does no work.
  void load(PlantT& plant, double h, const VectorXd& v) {
    const double w = kAlpha * h;
    const int n = plant.joints();
    const Vec3 turn = v.segment<3>(3).cross(v.head<3>());
    const Eigen::MatrixXd& mass = plant.mass_upper();
    right_ = -w * plant.bias();
    right_.head<3>() += (w * mass(0, 0)) * turn;  // M's linear block is m I
    right_.tail(n + 3).noalias() += w * (mass.topRightCorner(3, n + 3).transpose() * turn);
    drives_.load(w, v.tail(n), right_.tail(n));
    legs_.load(mass, drives_.diagonal(), right_);
    Vec3 momentum = mass.block<3, 3>(0, 3).transpose() * v.head<3>();
    momentum += mass.block<3, 3>(3, 3).selfadjointView<Eigen::Upper>() * v.segment<3>(3);
    momentum += mass.block(3, 6, 3, n) * v.tail(n);
    legs_.add_gyroscopic(w * momentum);
  }

  template <int N>
  void solve(PlantT& plant, double h, Solver<N>& solver) {
    auto& p = solver.problem;
    legs_.fill(p);
    p.rigid = false;
    p.contacts.resize(live_.size());
    for (std::size_t k = 0; k < live_.size(); ++k) pose(plant, h, live_[k], p, p.contacts[k]);
    if (!(kFlatFirst && solver.flat.solve(p))) solver.nested.solve(p);
    p.find_velocities();
    std::fill(impulse_.begin(), impulse_.end(), Vec3::Zero());
    for (const auto& c : p.contacts) {
      const int leg = leg_of(plant, c.slot);
      if (leg < 0) continue;
      const Vec3 world = c.axes.transpose() * c.foot.impulse;
      impulse_[leg].noalias() += plant.feet[c.slot].jl.transpose() * world;
    }
    legs_.restore(p, impulse_, dv_);
  }

  template <int N>
  void pose(PlantT& plant, double h, std::size_t i, ImpulseProblem<N>& p, StepContact<N>& c) const {
    const auto& foot = plant.feet[i];
    const FrictionLaw& friction = plant.law.friction;
    const double w = kAlpha * h;
    c.slot = i;
    c.start = foot.velocity + drift_;
    legs_.place(leg_of(plant, i), foot.jb, foot.jl, int(p.b.size()), c);
    p.rigid |= c.foot.g.isZero(0.0);
    c.align(foot.ground.normal);
    c.foot.frozen = -1.0;
    c.foot.normal = NormalStep(plant.law.normal, foot.k_scale, foot.memory.touch_speed,
                               -foot.ground.gap, h, w);
    c.foot.friction = SlipLaw(friction, foot.mu_scale, foot.memory.sliding, h, w);
    c.foot.shift.setZero();
    if (friction.kind == FrictionKind::bristle) {
      const double k = friction.bristle_stiffness;
      c.foot.shift = (k / (h * k + friction.bristle_damping)) *
                     (c.axes.template topRows<2>() * foot.memory.stretch);
    }
    c.foot.rate = c.start.z();
    c.foot.slip = (c.start.template head<2>() + c.foot.shift).norm();
  }

  // Books a contact's impulse and moves its bristle; what it gave beyond what it had stored, in the
  // axes and at the depth of the solve, is an error of the solve.
  template <int N>
  void settle(PlantT& plant, double h, const StepContact<N>& c, EnergyLedger& ledger) {
    auto& foot = plant.feet[c.slot];
    if (!foot.memory.touching && c.foot.impulse.isZero(0.0)) return;
    const Vec3& n = foot.ground.normal;
    const Vec3 force = c.axes.transpose() * c.foot.impulse / (kAlpha * h);
    const Vec3 velocity = c.axes.transpose() * c.velocity;
    const double depth = c.foot.normal.depth_at(c.velocity.z());
    const double before = plant.stored_normal(foot) + plant.stored_bristle(foot);
    ledger.add_contact(c.slot, force, velocity, n, h);
    if (plant.law.friction.kind == FrictionKind::bristle) {
      stretch_bristle(plant.law.friction, foot.mu_scale, n, force, h, foot.memory);
      const double slip = (c.velocity.template head<2>() + c.foot.shift).norm();
      foot.memory.sliding = c.foot.friction.slides(slip, c.foot.impulse.z());
    }
    if (!foot.memory.touching) deepest_first_touch_ = std::max(deepest_first_touch_, depth);
    foot.memory.touching = true;
    const double after = foot.k_scale * plant.law.normal.energy(depth) + plant.stored_bristle(foot);
    injection_ += std::max(0.0, h * force.dot(velocity) + after - before);
  }

  // q moves with v_a; the linear velocity, kept in body axes, is carried into the turned ones.
  void move(double h, VectorXd& q, VectorXd& v) {
    v += dv_ / kAlpha;
    xi_ = h * mean_;
    retract(q, xi_, q);
    v.head<3>() = exp_quaternion(xi_.segment<3>(3)).conjugate() * v.head<3>();
    largest_rate_step_ = std::max(largest_rate_step_, h * largest_rate(mean_));
  }

  LegElimination legs_;
  JointDrives drives_;
  Solver<6> base_;
  Solver<Eigen::Dynamic> any_;     // with the joints of legs that are kept
  std::vector<std::size_t> live_;  // contacts in the step
  std::vector<char> used_;         // legs with a contact in the step
  std::vector<Vec3> impulse_;      // J_l^T lambda per leg
  VectorXd right_, dv_, mean_, xi_;
  Vec3 drift_ = Vec3::Zero();
  long solved_again_ = 0, halved_ = 0;
  double largest_rate_step_ = 0.0, injection_ = 0.0, deepest_first_touch_ = 0.0;
};

}  // namespace hexapod
