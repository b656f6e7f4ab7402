// Robust fixed step: servos, feet and friction solved together at the end of the step as nonlinear
// laws, by a Newton iteration on the six base velocities with every foot solved exactly inside. Order 1,
// stable and dissipative at any stiffness: K, slip slope and gains set no limit on the step.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "plant/chart.hpp"
#include "plant/plant.hpp"
#include "plant/reaction.hpp"
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
  static constexpr bool kForcesAtStepEnd = true;
  static constexpr bool kNeedsSeparatedFeet = true;

  explicit RobustStep(const PlantT& plant)
      : legs_(plant.joints() / 3), drives_(plant.joints()), leg_in_contact_(plant.joints() / 3),
        leg_impulse_(plant.joints() / 3), right_(plant.tree.nv), dv_(plant.tree.nv),
        velocity_used_(plant.tree.nv), xi_(plant.tree.nv), left_(plant.joints()),
        outer_(plant.joints()), motion_(plant.joints()), reaction_(VectorXd::Zero(plant.joints())) {}

  // One step from the evaluated state; in halves where something turns so fast that the mass matrix
  // and the Coriolis forces at the start are not accurate enough for the full step.
  void step(PlantT& plant, Reference& reference, double t, double h, VectorXd& q, VectorXd& v,
            EnergyLedger& ledger) {
    advance_in_parts(plant, reference, t, h, q, v, ledger, kMaxHalvings);
  }

  std::map<std::string, double> counters() const {
    const auto sum = [this](const auto& of) {
      return double(of(base_solver_) + of(any_solver_));
    };
    return {{"outer_iterations", sum([](const auto& s) { return s.nested.iterations; })},
            {"convex_finishes", sum([](const auto& s) { return s.nested.convex_finishes; })},
            {"flat_sweeps", sum([](const auto& s) { return s.flat.sweeps; })},
            {"flat_hits", sum([](const auto& s) { return s.flat.hits; })},
            {"solved_again", double(solved_again_)},
            {"halved", double(halved_)},
            {"largest_rate_step", largest_rate_step_},
            {"contact_injection", energy_injection_},
            {"deepest_first_touch", deepest_first_touch_}};
  }

 private:
  static constexpr double kImplicitness = 0.75;  // alpha, -
  static constexpr double kMaxTurn = 0.05;       // rad, of a joint or the base in one step
  // Reach of a step: a foot h (kReachSpeed + kReachFactor |u|) from the ground may touch in it.
  static constexpr double kReachSpeed = 2.0;   // m/s
  static constexpr double kReachFactor = 3.0;  // -
  static constexpr int kMaxPasses = 8, kMaxPassesWithFriction = 40, kMaxHalvings = 5;

  template <int N>
  struct Solver {
    ImpulseProblem<N> problem;
    FlatNewton<N> flat;
    NestedNewton<N> nested;
  };

  static double largest_rate(const VectorXd& v) { return v.tail(v.size() - 3).cwiseAbs().maxCoeff(); }

  void advance_in_parts(PlantT& plant, Reference& reference, double t, double h, VectorXd& q, VectorXd& v,
          EnergyLedger& ledger, int halvings) {
    if (halvings == 0 || h * largest_rate(v) <= kMaxTurn)
      return advance(plant, reference, t, h, q, v, ledger);
    ++halved_;
    advance_in_parts(plant, reference, t, 0.5 * h, q, v, ledger, halvings - 1);
    plant.evaluate(t + 0.5 * h, q, v, 0.5 * h);
    plant.update_memories();
    advance_in_parts(plant, reference, t + 0.5 * h, 0.5 * h, q, v, ledger, halvings - 1);
  }

  void advance(PlantT& plant, Reference& reference, double t, double h, VectorXd& q, VectorXd& v,
               EnergyLedger& ledger) {
    if constexpr (PlantT::kPrescribed) take_motion(reference, t + h, h, q, v);
    else
      drives_.begin(plant.drive, plant.dry, reference, t + h, h, kImplicitness, q.tail(plant.joints()),
                    v.tail(plant.joints()));
    if (plant.needs_external && !PlantT::kPrescribed) plant.find_external(drives_.external());
    find_contacts(plant, t, h, q);
    if (legs_.keeps_any()) solve_and_accept(plant, h, v, any_solver_, ledger);
    else solve_and_accept(plant, h, v, base_solver_, ledger);
    move_state(h, q, v);
  }

  template <int N>
  void solve_and_accept(PlantT& plant, double h, const VectorXd& v, Solver<N>& solver, EnergyLedger& ledger) {
    const int most = drives_.dry() ? kMaxPassesWithFriction : kMaxPasses;
    for (int pass = 0;; ++pass) {
      load(plant, h, v);
      solve(plant, h, solver);
      if (drives_.dry()) stop_stuck(v);
      velocity_used_ = v + dv_;
      if constexpr (PlantT::kPrescribed) break;
      bool changed = drives_.find_changes(velocity_used_.tail(plant.joints()));
      if (drives_.dry()) changed |= find_friction_changes(plant, h, v);
      if (plant.needs_external) changed |= find_load_changes(plant, h);
      if (!changed || pass == most) break;
      ++solved_again_;
    }
    if constexpr (PlantT::kPrescribed) accumulate_reaction(plant, h, ledger);
    else drives_.accumulate(velocity_used_.tail(plant.joints()), ledger, plant.drive_counters);
    ledger.push += h * plant.push_power(velocity_used_);
    for (const auto& c : solver.problem.contacts) accept_contact(plant, h, c, ledger);
  }

  // Joints that follow a motion: by how much their rates change for their inertia and, with what they move
  // by over the step, for the contacts.
  void take_motion(Reference& reference, double end, double h, const VectorXd& q, const VectorXd& v) {
    const Eigen::Index n = motion_.q.size();
    motion_.take_motion(reference, end);
    rate_change_ = kImplicitness * (motion_.v - v.tail(n));
    mean_change_ = (motion_.q - q.tail(n)) / h - v.tail(n);
  }

  // Work of the torques that the motion takes.
  void accumulate_reaction(const PlantT& plant, double h, EnergyLedger& ledger) {
    for (int j = 0; j < plant.joints(); ++j)
      reaction_[j] += plant.drive.resistance_to(j, reaction_[j], velocity_used_[6 + j], outer_[j]);
    add_reaction_work(plant, velocity_used_, reaction_, outer_, h, ledger);
  }

  void stop_stuck(const VectorXd& v) {
    for (int j = 0; j < int(v.size()) - 6; ++j)
      if (drives_.stuck(j)) dv_[6 + j] = -kImplicitness * v[6 + j];
  }

  // Of the joints' rows of M dv = w (torque of drives + rest) the rest: bias and feet.
  bool find_friction_changes(const PlantT& plant, double h, const VectorXd& v) {
    const double w = kImplicitness * h;
    rate_end_ = (v + dv_ / kImplicitness).tail(plant.joints());
    for (int j = 0; j < plant.joints(); ++j)
      left_[j] = (free_right_[j] + leg_impulse_[j / 3][j % 3] - plant.inertial_torque(j, dv_)) / w;
    return drives_.find_friction_changes(rate_end_, velocity_used_.tail(plant.joints()), left_);
  }

  // The same rows but for inertial forces.
  bool find_load_changes(const PlantT& plant, double h) {
    for (int j = 0; j < plant.joints(); ++j)
      outer_[j] = (free_right_[j] + leg_impulse_[j / 3][j % 3]) / (kImplicitness * h);
    return drives_.find_load_changes(velocity_used_.tail(plant.joints()), outer_);
  }

  // Contacts that may have a force in this step; a leg with two of them keeps its joints in the system.
  void find_contacts(PlantT& plant, double t, double h, const VectorXd& q) {
    const double rise = plant.terrain.surface_height(t + h) - plant.terrain.surface_height(t);
    drift_ = Vec3(0.0, 0.0, -rise) / h + plant.ground_velocity;  // the mean velocity for that at t
    in_step_.clear();
    legs_.keep_none();
    std::fill(leg_in_contact_.begin(), leg_in_contact_.end(), false);
    for (std::size_t i = 0; i < plant.feet.size(); ++i) {
      auto& foot = plant.feet[i];
      if (!foot.active && foot.ground.gap >= kFarAway) continue;
      if (!foot.active && foot.ground.gap > h * (kReachSpeed + kReachFactor * foot.velocity.norm())) continue;
      if (!foot.active && !plant.terrain.patches.empty())
        std::tie(foot.mu_scale, foot.k_scale) =
            plant.terrain.patch_factors(q[0] + foot.center.x(), q[1] + foot.center.y());
      in_step_.push_back(i);
      const int leg = leg_of(plant, i);
      if (leg < 0 || PlantT::kPrescribed) continue;
      if (leg_in_contact_[leg]) legs_.keep(leg);
      leg_in_contact_[leg] = true;
    }
  }

  static int leg_of(const PlantT& plant, std::size_t contact) {
    const std::size_t joint = plant.mounts[plant.foot_of(contact)].joint;
    return joint < 2 ? -1 : int(joint - 2) / 3;
  }

  // (M + w D + w h K) dv = r with w = alpha h; impulses are alpha times those of the step. Of the bias
  // the body-axes term omega x v_lin is left out, `move_state` turns the velocity instead; omega x (angular
  // momentum L) is taken as -L x omega_a, which does no work.
  void load(PlantT& plant, double h, const VectorXd& v) {
    const double w = kImplicitness * h;
    const int n = plant.joints();
    const Vec3 turn = v.segment<3>(3).cross(v.head<3>());
    const Eigen::MatrixXd& mass = plant.mass_upper();
    right_ = -w * plant.bias();
    right_.head<3>() += (w * mass(0, 0)) * turn;  // M's linear block is m I
    right_.tail(n + 3).noalias() += w * (mass.topRightCorner(3, n + 3).transpose() * turn);
    if (drives_.dry() || PlantT::kPrescribed) free_right_ = right_.tail(n);
    if constexpr (PlantT::kPrescribed) {
      legs_.load_base(mass, rate_change_, right_);
    } else {
      drives_.load(w, v.tail(n), right_.tail(n));
      legs_.load(mass, drives_.diagonal(), right_);
    }
    Vec3 momentum = mass.block<3, 3>(0, 3).transpose() * v.head<3>();
    momentum += mass.block<3, 3>(3, 3).selfadjointView<Eigen::Upper>() * v.segment<3>(3);
    momentum += mass.block(3, 6, 3, n) * v.tail(n);
    legs_.add_gyroscopic(w * momentum);
  }

  // Radius of gyration of the whole about the base's frame, m.
  static double gyration(const PlantT& plant) {
    const Eigen::MatrixXd& mass = plant.mass_upper();
    return std::sqrt((mass(3, 3) + mass(4, 4) + mass(5, 5)) / (3.0 * mass(0, 0)));
  }

  template <int N>
  void solve(PlantT& plant, double h, Solver<N>& solver) {
    auto& p = solver.problem;
    legs_.fill(p);
    p.rigid = false;
    p.length = gyration(plant);
    p.contacts.resize(in_step_.size());
    for (std::size_t k = 0; k < in_step_.size(); ++k)
      set_up_contact(plant, h, in_step_[k], p, p.contacts[k]);
    if (!(kFlatFirst && solver.flat.solve(p))) solver.nested.solve(p);
    p.find_velocities();
    if constexpr (PlantT::kPrescribed) return restore_base(plant, h, p);
    else restore_legs(plant, p);
  }

  template <int N>
  void restore_legs(const PlantT& plant, const ImpulseProblem<N>& p) {
    std::fill(leg_impulse_.begin(), leg_impulse_.end(), Vec3::Zero());
    for (const auto& c : p.contacts) {
      const int leg = leg_of(plant, c.slot);
      if (leg < 0) continue;
      const Vec3 world = c.axes.transpose() * c.foot.impulse;
      leg_impulse_[leg].noalias() += plant.feet[c.slot].jl.transpose() * world;
    }
    legs_.restore(p, leg_impulse_, dv_);
  }

  // The change of the base; the torques that the joints take, of the rows of M dv = w torque + rest.
  template <int N>
  void restore_base(const PlantT& plant, double h, const ImpulseProblem<N>& p) {
    dv_.setZero();
    for (const auto& c : p.contacts)
      plant.add_jacobian_transposed(c.slot, Vec3(c.axes.transpose() * c.foot.impulse), dv_);
    outer_ = (free_right_ + dv_.tail(reaction_.size())) / (kImplicitness * h);
    reaction_ = -(free_right_ + dv_.tail(reaction_.size()));
    dv_.template head<6>() = p.v.template head<6>();
    dv_.tail(rate_change_.size()) = rate_change_;
    for (int j = 0; j < plant.joints(); ++j) reaction_[j] += plant.inertial_torque(j, dv_);
    reaction_ /= kImplicitness * h;
    dv_.tail(mean_change_.size()) = mean_change_;
  }

  template <int N>
  void set_up_contact(PlantT& plant, double h, std::size_t i, ImpulseProblem<N>& p, StepContact<N>& c) const {
    const auto& foot = plant.feet[i];
    const FrictionLaw& friction = plant.law.friction;
    const double w = kImplicitness * h;
    c.slot = i;
    c.start = foot.velocity + drift_;
    place(plant, i, int(p.b.size()), c);
    p.rigid |= c.foot.g.isZero(0.0);
    c.align(foot.ground.normal);
    c.foot.friction_bound = -1.0;
    c.foot.normal = NormalStep(plant.law.normal, foot.k_scale, foot.memory.touch_speed,
                               -foot.ground.gap, h, w);
    c.foot.friction = SlipLaw(friction, foot.mu_scale, foot.memory.sliding, h, w);
    c.foot.shift.setZero();
    if (friction.has_bristle())
      c.foot.shift = friction.bristle_slip_rate(h) *
                     (c.axes.template topRows<2>() * foot.memory.stretch);
    c.foot.rate = c.start.z();
    c.foot.slip = (c.start.template head<2>() + c.foot.shift).norm();
  }

  template <int N>
  void place(const PlantT& plant, std::size_t i, int size, StepContact<N>& c) const {
    const auto& foot = plant.feet[i];
    if constexpr (PlantT::kPrescribed) {
      c.jt.template topRows<6>() = foot.jb.transpose();
      c.foot.g.setZero();
      c.free = c.start + leg_velocity(plant, i, mean_change_);
    } else {
      legs_.place(leg_of(plant, i), foot.jb, foot.jl, size, c);
    }
  }

  // Adds a contact's work and impulse to the ledger and moves its bristle. Energy that it returned beyond
  // what it had stored, in the axes and at the depth of the solve, is an error of the solve.
  template <int N>
  void accept_contact(PlantT& plant, double h, const StepContact<N>& c, EnergyLedger& ledger) {
    auto& foot = plant.feet[c.slot];
    if (!foot.memory.touching && c.foot.impulse.isZero(0.0)) return;
    const Vec3& n = foot.ground.normal;
    const Vec3 force = c.axes.transpose() * c.foot.impulse / (kImplicitness * h);
    const Vec3 velocity = c.axes.transpose() * c.velocity;
    const double depth = c.foot.normal.depth_at(c.velocity.z());
    const double before = plant.stored_normal(foot) + plant.stored_bristle(foot);
    ledger.add_contact(c.slot, force, velocity, n, h);
    if (plant.law.friction.has_bristle()) {
      update_bristle(plant.law.friction, foot.mu_scale, n, force, h, foot.memory);
      const double slip = (c.velocity.template head<2>() + c.foot.shift).norm();
      foot.memory.sliding = c.foot.friction.slides(slip, c.foot.impulse.z());
    }
    if (!foot.memory.touching) deepest_first_touch_ = std::max(deepest_first_touch_, depth);
    foot.memory.touching = true;
    const double after = foot.k_scale * plant.law.normal.energy(depth) + plant.stored_bristle(foot);
    energy_injection_ += std::max(0.0, h * force.dot(velocity) + after - before);
  }

  // q moves with v_a; the linear velocity, in body axes, is transformed into the turned ones.
  void move_state(double h, VectorXd& q, VectorXd& v) {
    v += dv_ / kImplicitness;
    if constexpr (PlantT::kPrescribed) v.tail(motion_.v.size()) = motion_.v;
    if (drives_.dry())
      for (int j = 0; j < int(v.size()) - 6; ++j)
        if (drives_.stuck(j)) v[6 + j] = 0.0;
    xi_ = h * velocity_used_;
    retract(q, xi_, q);
    if constexpr (PlantT::kPrescribed) q.tail(motion_.q.size()) = motion_.q;
    v.head<3>() = exp_quaternion(xi_.segment<3>(3)).conjugate() * v.head<3>();
    largest_rate_step_ = std::max(largest_rate_step_, h * largest_rate(velocity_used_));
  }

  LegElimination legs_;
  JointDrives drives_;
  Solver<6> base_solver_;
  Solver<Eigen::Dynamic> any_solver_;  // with the joints of legs that are kept
  std::vector<std::size_t> in_step_;     // contacts in the step
  std::vector<char> leg_in_contact_;     // legs with a contact in the step
  std::vector<Vec3> leg_impulse_;        // J_l^T lambda per leg
  VectorXd right_, dv_, velocity_used_, xi_;
  VectorXd free_right_, rate_end_, left_, outer_;  // of the joints, for dry friction
  Vec3 drift_ = Vec3::Zero();
  SetPoints motion_;  // at the end of the step, where it is prescribed
  VectorXd rate_change_, mean_change_, reaction_;
  long solved_again_ = 0, halved_ = 0;
  double largest_rate_step_ = 0.0, energy_injection_ = 0.0, deepest_first_touch_ = 0.0;
};

}  // namespace hexapod
