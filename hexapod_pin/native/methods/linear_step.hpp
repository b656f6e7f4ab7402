// One linearly implicit step from an evaluated state: (M + hD + h^2 K) a = g - h K v, with the complete,
// nonsymmetric contact Jacobian, servos and joint stops in D and K; and what it says of the step's end.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "plant/plant.hpp"
#include "plant/reaction.hpp"
#include "plant/reference.hpp"

namespace hexapod {

template <class PlantT>
class LinearStep {
  using LegJacobian = typename PlantT::System::LegJacobian;

 public:
  explicit LinearStep(const PlantT& plant)
      : acceleration_(plant.tree.nv), v_end_(plant.tree.nv), set_points_(plant.joints()),
        mode_(plant.joints()), released_(plant.feet.size()),
        secant_(plant.feet.size()), force_(plant.feet.size()), velocity_(plant.feet.size()),
        used_(VectorXd::Zero(plant.tree.nv)), reaction_(plant.joints()),
        external_(VectorXd::Zero(plant.joints())), left_(VectorXd::Ones(plant.joints())) {}

  // Servos take the set-points at t_end and act there, all within their limits; joints at rest with dry
  // friction are stuck; feet in the ground have a force.
  void begin(const PlantT& plant, Reference& reference, double t_end, const VectorXd& v) {
    begin_contacts(plant, reference, t_end);
    std::fill(mode_.begin(), mode_.end(), DriveMode());
    saturated_ = false;
    if (!plant.dry) return;
    for (int j = 0; j < plant.joints(); ++j) mode_[j].friction = plant.drive.sliding(j, v[6 + j]);
    friction_changes_.assign(plant.joints(), 0);
  }

  // Drives stay in the modes of the plant.
  void begin_frozen(const PlantT& plant, Reference& reference, double t_end) {
    begin_contacts(plant, reference, t_end);
    mode_ = plant.mode;
  }

  void solve(PlantT& plant, double h, const VectorXd& joints, const VectorXd& v) {
    auto& system = plant.system;
    system.load(plant.mass_upper());
    acceleration_ = -plant.bias();
    if (plant.needs_external) find_external_at_start(plant);
    if constexpr (PlantT::kPrescribed) take_motion(h, joints, v);
    else
      for (int j = 0; j < plant.joints(); ++j) add_joint(plant, j, h, joints[j], v[6 + j]);
    for (std::size_t i = 0; i < plant.feet.size(); ++i)
      if (!released_[i]) add_foot(plant, i, h, v);
    system.factor();
    system.solve(acceleration_);
    v_end_ = v + h * acceleration_;
    if constexpr (PlantT::kPrescribed) {
      v_end_.tail(plant.joints()) = set_points_.v;
      used_.template head<6>() = v_end_.template head<6>();
    }
    if (plant.dry) stop_stuck(plant, h, v);
  }

  const VectorXd& v_end() const { return v_end_; }
  const VectorXd& set_points() const { return set_points_.q; }  // joints at the end, rad
  const Vec3& force(std::size_t contact) const { return force_[contact]; }  // at the end, on the foot
  bool has_force(std::size_t contact) const { return !released_[contact]; }

  // Moves servos that would pass their limit at the end of the step onto it, and those on it to another
  // piece of it, but not back; true if any has changed.
  bool find_saturated(const PlantT& plant, double h, const VectorXd& joints) {
    if (PlantT::kPrescribed) return false;
    bool found = false;
    for (int j = 0; j < plant.joints(); ++j) {
      LimitMode& now = mode_[j].limit;
      if (now != LimitMode::within && plant.drive.line_slope[j] == 0.0) continue;
      const double demand = end_demand(plant, j, h, joints[j]);
      // A demand that overflows in the solve is not a number: the servo is past its limit too.
      const LimitMode next =
          std::isnan(demand) ? LimitMode::lower_cap
                             : plant.drive.limit_mode(j, demand, v_end_[6 + j], DriveLaw::kLimitSlack);
      if (next == now || next == LimitMode::within) continue;
      now = next;
      found = saturated_ = true;
    }
    return found;
  }

  // Joints that would turn back under their friction are stuck; those stuck that would have to hold more
  // than it slide. True if any has changed. Needs find_end.
  bool find_changed_friction(const PlantT& plant, double h, const VectorXd& joints) {
    if (!plant.dry) return false;
    bool found = false;
    find_holding(plant, h, joints);
    for (int j = 0; j < plant.joints(); ++j) {
      FrictionMode& now = mode_[j].friction;
      const double motor = plant.drive.torque_on(j, mode_[j].limit, end_demand(plant, j, h, joints[j]), 0.0);
      const double limit = plant.drive.holding_limit(j, motor, holding_[j], external_[j]);
      const FrictionMode next = next_friction(limit, now, v_end_[6 + j], holding_[j]);
      if (next == now || friction_changes_[j] >= kMaxFrictionChanges) continue;
      now = next;
      ++friction_changes_[j];
      found = true;
    }
    return found;
  }

  // Forces and contact velocities at the end of the step, as the linearised laws give them.
  void find_end(const PlantT& plant, double h) {
    for (std::size_t i = 0; i < released_.size(); ++i) {
      if (released_[i]) continue;
      const auto& foot = plant.feet[i];
      Vec3 moved;
      velocity_[i] = end_velocity(plant, i, h, v_end_, moved);
      force_[i] = foot.contact.force - foot.contact.slope(secant_[i]) * (velocity_[i] - foot.velocity) -
                  (h * foot.ground.normal.dot(moved)) * foot.contact.minus_dz;
    }
    if (plant.needs_external && !PlantT::kPrescribed) find_external_at_end(plant, h);
  }

  // Releases feet whose normal force at the end is negative and gives those whose slip would reverse the
  // secant of their friction law; true if any is new. Needs find_end.
  bool find_changed_contacts(const PlantT& plant) {
    bool found = false;
    for (std::size_t i = 0; i < released_.size(); ++i) {
      if (released_[i]) continue;
      const auto& foot = plant.feet[i];
      const Vec3& n = foot.ground.normal;
      if (n.dot(force_[i]) < 0.0) {
        released_[i] = found = true;
      } else if (!secant_[i] && foot.contact.softens && reverses(foot.velocity, velocity_[i], n)) {
        secant_[i] = found = true;
      }
    }
    return found;
  }

  // Works and impulses of the step, from the forces at its end. Needs find_end.
  void accumulate(const PlantT& plant, double h, const VectorXd& joints,
                  EnergyLedger& ledger) {
    at_stop_ = false;
    ledger.push += h * plant.push_power(v_end_);
    if constexpr (PlantT::kPrescribed) accumulate_reaction(plant, h, ledger);
    for (int j = 0; j < (PlantT::kPrescribed ? 0 : plant.joints()); ++j) {
      const double rate = v_end_[6 + j];
      const double torque =
          plant.drive.torque_on(j, mode_[j].limit, end_demand(plant, j, h, joints[j]), rate);
      ledger.servo += h * torque * rate;
      ledger.joint_damping += h * plant.drive.damping[j] * rate * rate;
      if (plant.dry)
        ledger.joint_damping -=
            h * plant.drive.dry_torque(j, mode_[j].friction, torque, rate, external_[j]) * rate;
      const StopTorque& stop = plant.stop[j];
      if (stop.stiffness == 0.0) continue;
      at_stop_ = true;
      ledger.stops -= h * stop.after(h * rate, rate - plant.rate(j)) * rate;
    }
    for (std::size_t i = 0; i < released_.size(); ++i)
      if (!released_[i])
        ledger.add_contact(i, force_[i], velocity_[i], plant.feet[i].ground.normal, h);
  }

  // Limits and stops of this step, on to the counters. Needs accumulate.
  void count(PlantT& plant, double h) const {
    if (!saturated_ && !at_stop_ && plant.drive_counters.idle()) return;
    for (int j = 0; j < plant.joints(); ++j)
      plant.drive_counters.add(
          j, mode_[j].limit, plant.stop[j].stiffness != 0.0 ? StopMode::upper : StopMode::free, h);
  }

 private:
  static constexpr int kMaxFrictionChanges = 4;  // of one joint in one step

  void begin_contacts(const PlantT& plant, Reference& reference, double t_end) {
    set_points_.take(reference, t_end);
    for (std::size_t i = 0; i < released_.size(); ++i) {
      released_[i] = !plant.feet[i].active;
      secant_[i] = false;
    }
  }

  // Joints that follow a motion: their mean rates over the step, by which they move, and accelerations;
  // the base as if it went on.
  void take_motion(double h, const VectorXd& joints, const VectorXd& v) {
    const Eigen::Index n = joints.size();
    v_end_ = used_ = v;
    v_end_.tail(n) = set_points_.v;
    used_.tail(n) = (set_points_.q - joints) / h;
    acceleration_.tail(n) = (set_points_.v - v.tail(n)) / h;
  }

  // Velocity of a contact at the end of the step for v there; `moved`: that by which it has moved.
  Vec3 end_velocity(const PlantT& plant, std::size_t i, double h, const VectorXd& v, Vec3& moved) const {
    const auto& foot = plant.feet[i];
    if constexpr (PlantT::kPrescribed) {
      moved = plant.jacobian_times(i, foot.jb, foot.jl, used_) - plant.ground_velocity;
      return plant.jacobian_times(i, foot.jb, foot.jl, v) - plant.ground_velocity +
             h * plant.jacobian_times(i, foot.qb, foot.ql, used_);
    }
    moved = plant.jacobian_times(i, foot.jb, foot.jl, v) - plant.ground_velocity;
    return moved + h * plant.jacobian_times(i, foot.qb, foot.ql, v);
  }

  // Work of the torques that the motion takes.
  void accumulate_reaction(const PlantT& plant, double h, EnergyLedger& ledger) {
    const auto force = [this](std::size_t i) { return released_[i] ? Vec3(Vec3::Zero()) : force_[i]; };
    reaction_torque(plant, v_end_, acceleration_, force, reaction_, external_);
    add_reaction_work(plant, v_end_, reaction_, external_, h, ledger);
  }

  void add_joint(PlantT& plant, int j, double h, double angle, double rate) {
    const DriveLaw& drive = plant.drive;
    const StopTorque& stop = plant.stop[j];
    const LimitMode limit = mode_[j].limit;
    const double motor = drive.torque_on(j, limit, demand_at(plant, j, angle, h * rate, rate), rate);
    const GearResponse slopes = drive.gear_response(j, mode_[j].friction, motor, rate, external_[j]);
    left_[j] = 1.0 - slopes.per_load;
    double torque = stop.torque - left_[j] * stop.stiffness * h * rate - drive.damping[j] * rate;
    const double damping = drive.damping[j] + drive.damping_after(j, limit, slopes);
    const double stiffness = left_[j] * stop.stiffness + drive.stiffness_after(j, limit, slopes);
    torque += motor;
    acceleration_[6 + j] += torque;
    plant.system.add_diagonal(j, h * (damping + left_[j] * stop.damping + h * stiffness));
    if (!plant.dry) return;
    acceleration_[6 + j] += drive.dry_torque(j, mode_[j].friction, motor, rate, external_[j]);
    if (!mode_[j].stuck()) return;
    acceleration_[6 + j] -= kLock * (rate / h);
    plant.system.add_diagonal(j, kLock);
  }

  void stop_stuck(const PlantT& plant, double h, const VectorXd& v) {
    for (int j = 0; j < plant.joints(); ++j) {
      if (!mode_[j].stuck()) continue;
      acceleration_[6 + j] = -v[6 + j] / h;
      v_end_[6 + j] = 0.0;
    }
  }

  // External torques on the joints at the start of the step and at its end, of contacts that have a force.
  void find_external_at_start(const PlantT& plant) {
    plant.find_external([&](std::size_t i) {
      return released_[i] ? Vec3(Vec3::Zero()) : plant.feet[i].contact.force; }, external_);
  }
  void find_external_at_end(const PlantT& plant, double h) {
    plant.find_external([&](std::size_t i) {
      return released_[i] ? Vec3(Vec3::Zero()) : force_[i]; }, external_);
    for (int j = 0; j < plant.joints(); ++j) {
      const double rate = v_end_[6 + j];
      external_[j] += plant.stop[j].after(h * rate, rate - plant.rate(j)) - plant.stop[j].torque;
    }
  }

  // What is left to stuck joints at the end of the step, N m.
  void find_holding(const PlantT& plant, double h, const VectorXd& joints) {
    holding_ = -plant.bias();
    for (std::size_t i = 0; i < released_.size(); ++i)
      if (!released_[i]) plant.add_jacobian_transposed(i, force_[i], holding_);
    holding_ = holding_.tail(plant.joints()).eval();
    for (int j = 0; j < plant.joints(); ++j) {
      const double motor =
          plant.drive.torque_on(j, mode_[j].limit, end_demand(plant, j, h, joints[j]), 0.0);
      holding_[j] += motor + plant.stop[j].after(0.0, -plant.rate(j)) -
                     plant.inertial_torque(j, acceleration_);
    }
  }

  static FrictionMode next_friction(double level, FrictionMode now, double rate, double holding) {
    if (now == FrictionMode::forward) return rate < 0.0 ? FrictionMode::stuck : now;
    if (now == FrictionMode::backward) return rate > 0.0 ? FrictionMode::stuck : now;
    if (now == FrictionMode::none || !(std::abs(holding) > level * (1.0 + kFrictionSlack))) return now;
    return holding > 0.0 ? FrictionMode::forward : FrictionMode::backward;
  }
  static constexpr double kFrictionSlack = 1e-9;  // -, of the round-off in what is left

  // hD + h^2 K = J^T (h W (J + hQ) + h^2 kz n^T J) on the left; J^T (f - h (W Q + kz n^T J) v) right.
  void add_foot(PlantT& plant, std::size_t i, double h, const VectorXd& v) {
    const auto& foot = plant.feet[i];
    const ContactForce& contact = foot.contact;
    const Vec3& n = foot.ground.normal;
    const Mat3 w = h * contact.slope(secant_[i]);
    const Vec3 k = (h * h) * contact.minus_dz;
    if constexpr (PlantT::kPrescribed) return add_foot_to_base(plant, i, h, w, k);
    const Eigen::Matrix<double, 3, 6> end_b = foot.jb + h * foot.qb;
    const LegJacobian end_l = foot.jl + h * foot.ql;
    Eigen::Matrix<double, 3, 6> xb = w.lazyProduct(end_b);
    LegJacobian xl = w.lazyProduct(end_l);
    xb.noalias() += k * (n.transpose() * foot.jb);
    xl.noalias() += k * (n.transpose() * foot.jl);
    const Vec3 drift = plant.jacobian_times(i, foot.qb, foot.ql, v);
    if (plant.needs_external) {
      const LegJacobian left = plant.left_by_gears(i, left_);
      plant.system.add_foot(int(plant.foot_of(i)), foot.jb, left, xb, xl);
      const Vec3 change = w * drift + (h * n.dot(foot.velocity)) * contact.minus_dz;
      plant.add_jacobian_transposed(i, contact.force, acceleration_);
      acceleration_.template head<6>().noalias() -= foot.jb.transpose() * change;
      for (std::size_t m = 0; m < plant.columns(i).size(); ++m)
        acceleration_[Tree::column(plant.columns(i)[m])] -= left.col(m).dot(change);
      return;
    }
    plant.system.add_foot(int(plant.foot_of(i)), foot.jb, foot.jl, xb, xl);
    const Vec3 f = contact.force - w * drift - (h * n.dot(foot.velocity)) * contact.minus_dz;
    plant.add_jacobian_transposed(i, f, acceleration_);
  }

  // The same where the joints' part of the motion is known.
  void add_foot_to_base(PlantT& plant, std::size_t i, double h, const Mat3& w, const Vec3& k) {
    const auto& foot = plant.feet[i];
    const ContactForce& contact = foot.contact;
    Eigen::Matrix<double, 3, 6> xb = w.lazyProduct(foot.jb + h * foot.qb);
    xb.noalias() += k * (foot.ground.normal.transpose() * foot.jb);
    plant.system.add_foot(int(plant.foot_of(i)), foot.jb, foot.jl, xb, foot.jl);
    Vec3 moved;
    const Vec3 change = end_velocity(plant, i, h, v_end_, moved) - foot.velocity;
    const Vec3 f = contact.force - contact.slope(secant_[i]) * change -
                   (h * foot.ground.normal.dot(moved)) * contact.minus_dz;
    acceleration_.template head<6>().noalias() += foot.jb.transpose() * f;
  }

  // After a joint has turned on from `angle` by `turn` [rad], its rate being `rate` [rad/s].
  double demand_at(const PlantT& plant, int j, double angle, double turn, double rate) const {
    return plant.drive.demand(j, set_points_.q[j] - angle - turn, set_points_.v[j] - rate,
                              set_points_.torque[j]);
  }
  double end_demand(const PlantT& plant, int j, double h, double angle) const {
    return demand_at(plant, j, angle, h * v_end_[6 + j], v_end_[6 + j]);
  }

  // Whether the slip, the part of the contact velocity across n, changes to the opposite direction.
  static bool reverses(const Vec3& before, const Vec3& after, const Vec3& n) {
    return before.dot(after) - n.dot(before) * n.dot(after) < 0.0;
  }

  VectorXd acceleration_, v_end_, holding_;
  SetPoints set_points_;
  std::vector<DriveMode> mode_;  // of each joint
  std::vector<int> friction_changes_;
  bool saturated_ = false, at_stop_ = false;  // a joint is at its limit, at a stop
  std::vector<char> released_;   // contacts without force in this step
  std::vector<char> secant_;     // contacts with the secant of their friction law
  std::vector<Vec3> force_, velocity_;
  VectorXd used_, reaction_;  // of prescribed motions: mean velocity of the step; torques, N m
  // Where a gear's friction depends on external torques: those on the joints, N m, and what gears leave of
  // a change of them, -.
  VectorXd external_, left_;
};

}  // namespace hexapod
