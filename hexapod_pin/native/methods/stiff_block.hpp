// The stiff part of y' = f(y) frozen at an evaluated state, and (I - sJ) x = b with it. Contacts are
// complete (their coupling, their friction, the turning of the contact point), servos and stops too;
// Coriolis, gravity and the configuration's pull on M are left out:
//   (M + sD + s^2 K) x_v = M b_v - s K b_xi,  x_xi = b_xi + s x_v,
// in the frame of the body; the chart's map is applied before and after. Bristles are eliminated. Joints
// that follow a given motion have no entries.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "plant/chart.hpp"
#include "plant/plant.hpp"
#include "plant/reaction.hpp"

namespace hexapod {

template <class PlantT>
class StiffBlock {
  using System = typename PlantT::System;
  using LegJacobian = typename System::LegJacobian;

 public:
  explicit StiffBlock(const PlantT& plant)
      : system_(plant.system), contacts_(plant.feet.size()), stiffness_(VectorXd::Zero(plant.joints())),
        damping_(stiffness_), left_(VectorXd::Ones(plant.joints())), lock_(plant.joints()),
        reaction_(stiffness_), external_(stiffness_), right_(plant.tree.nv),
        shift_(plant.tree.nv), force_(VectorXd::Zero(plant.tree.nv)) {
    for (const FootMount& mount : plant.mounts)
      for (std::size_t k = 0; k < plant.per_foot; ++k)
        columns_.push_back(plant.system.columns(plant.tree, mount));
  }

  // The plant has been evaluated at chart coordinates xi, its drives are in the modes it holds.
  template <class Xi>
  void capture(const PlantT& plant, const Xi& xi) {
    mass_ = plant.mass_upper();
    for (int j = 0; j < plant.joints(); ++j) {
      if constexpr (PlantT::kPrescribed) break;
      const DriveMode& mode = plant.mode[j];
      const GearResponse& slopes = plant.gear_slopes[std::size_t(j)];
      left_[j] = 1.0 - slopes.per_load;
      stiffness_[j] = left_[j] * plant.stop[j].stiffness + plant.drive.stiffness_after(j, mode.limit, slopes);
      damping_[j] = left_[j] * plant.stop[j].damping + plant.drive.damping[j] +
                    plant.drive.damping_after(j, mode.limit, slopes);
      lock_[j] = mode.stuck();
    }
    for (std::size_t i = 0; i < contacts_.size(); ++i) capture_contact(plant, i);
    chart_.capture(xi.template segment<3>(3));
  }

  // Whether the same contacts have a force.
  bool fits(const PlantT& plant) const {
    for (std::size_t i = 0; i < contacts_.size(); ++i)
      if (contacts_[i].has_force != has_force(plant.feet[i])) return false;
    return true;
  }

  void factor(const PlantT& plant, double s) {
    s_ = s;
    system_.load(mass_);
    for (int j = 0; j < plant.joints(); ++j)
      system_.add_diagonal(j, s * (damping_[j] + s * stiffness_[j]) + (lock_[j] ? kLock : 0.0));
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      FrozenContact& c = contacts_[i];
      eliminate_bristle(plant, c);
      if (!c.has_force) continue;
      const Vec3 k = (s * s) * c.k_effective;
      Eigen::Matrix<double, 3, 6> xb = c.w_effective.lazyProduct(s * (c.jb + s * c.qb));
      LegJacobian xl = c.w_effective.lazyProduct(s * (c.jl + s * c.ql));
      xb.noalias() += k * (c.n.transpose() * c.jb);
      xl.noalias() += k * (c.n.transpose() * c.jl);
      system_.add_foot(int(plant.foot_of(i)), c.jb, c.left, xb, xl);
    }
    system_.factor();
  }

  // A force [N] on a contact that presses: the next solution has it besides those of its change. After `factor`.
  void add_force(std::size_t i, const Vec3& force) {
    if (!contacts_[i].has_force) return;
    force_.template head<6>().noalias() += contacts_[i].jb.transpose() * force;
    for (std::size_t k = 0; k < columns_[i].size(); ++k)
      force_[Tree::column(columns_[i][k])] += contacts_[i].left.col(k).dot(force);
    has_force_ = true;
  }

  // Change of a pressing contact's gap [m] and of the rate at which its foot leaves [m/s], in the last solution.
  std::pair<double, double> gap_change(std::size_t i) const {
    const FrozenContact& c = contacts_[i];
    if (!c.has_force) return {0.0, 0.0};
    return {c.n.dot(jacobian_times(i, c.jb, c.jl, shift_)), c.n.dot(response(i).first)};
  }

  // b becomes x; bristles z may be empty.
  template <class Xi, class V, class Z>
  void solve(Xi xi, V v, Z z) {
    turn_into_body(xi);
    right_.noalias() = mass_.template selfadjointView<Eigen::Upper>() * v;
    right_.tail(stiffness_.size()) -= s_ * stiffness_.cwiseProduct(shift_.tail(stiffness_.size()));
    for (std::size_t i = 0; i < contacts_.size(); ++i)
      if (contacts_[i].has_force) add_contact_load(i, z);
    if (has_force_) {
      right_ += s_ * force_;
      force_.setZero();
      has_force_ = false;
    }
    if constexpr (PlantT::kPrescribed) right_.tail(stiffness_.size()).setZero();
    system_.solve(right_);
    for (std::size_t j = 0; j < lock_.size(); ++j)
      if (lock_[j]) right_[6 + j] = 0.0;
    v = right_;
    shift_ += s_ * right_;
    xi = shift_;
    xi.template head<3>() = chart_.linear * shift_.template head<3>();
    xi.template segment<3>(3) = chart_.angular * shift_.template segment<3>(3);
    for (std::size_t i = 0; i < std::size_t(z.size()) / 3; ++i) solve_bristle(i, z);
  }

  // Largest change of a contact's force, as the frozen laws give it, N, where the state is displaced so. After
  // `factor`.
  template <class Xi, class V, class Z>
  double largest_force_change(const Xi& xi, const V& v, const Z& z) {
    turn_into_body(xi);
    right_ = v;
    double most = 0.0;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      if (!contacts_[i].has_force) continue;
      Vec3 f = response(i).second;
      if (z.size() > 0) f += contacts_[i].by_stretch * z.template segment<3>(3 * i);
      most = std::max(most, f.norm());
    }
    return most;
  }

  // Adds the powers at the end of the correction last solved for: state and forces as evaluated, the
  // changes as the frozen laws give them. Servo demands and bristles' changes dz as above;
  // `acceleration` (nv) is that of a prescribed motion.
  template <class Z>
  void accumulate_power(const PlantT& plant, const VectorXd& v, const VectorXd& demand,
                        const VectorXd& acceleration, const Z& dz, EnergyLedger& ledger) {
    ledger.push += plant.push_power(v + right_);
    if constexpr (PlantT::kPrescribed) accumulate_reaction(plant, v, acceleration, dz, ledger);
    else accumulate_drives(plant, v, demand, dz, ledger);
    for (std::size_t i = 0; i < contacts_.size(); ++i)
      if (contacts_[i].has_force)
        ledger.add_contact(i, corrected_force(plant, i, dz),
                           plant.feet[i].velocity + response(i).first, contacts_[i].n, 1.0);
  }

 private:
  template <class Z>
  void accumulate_drives(const PlantT& plant, const VectorXd& v, const VectorXd& demand, const Z& dz,
                         EnergyLedger& ledger) {
    const DriveLaw& drive = plant.drive;
    if (plant.needs_external) find_external(plant, dz);
    for (int j = 0; j < plant.joints(); ++j) {
      const double turn = shift_[6 + j], change = right_[6 + j], rate = v[6 + j] + change;
      const double wanted = drive.demand_after(j, demand[j], turn, change);
      const double motor = drive.torque_on(j, plant.mode[j].limit, wanted, rate);
      ledger.servo += motor * rate;
      ledger.joint_damping += drive.damping[j] * rate * rate;
      if (plant.dry)
        ledger.joint_damping -=
            drive.dry_torque(j, plant.mode[j].friction, motor, rate, external_[j]) * rate;
      ledger.stops -= plant.stop[j].after(turn, change) * rate;
    }
  }

  template <class Z>
  void accumulate_reaction(const PlantT& plant, const VectorXd& v, const VectorXd& acceleration,
                           const Z& dz, EnergyLedger& ledger) {
    const auto force = [&](std::size_t i) { return corrected_force(plant, i, dz); };
    reaction_torque(plant, v, acceleration, force, reaction_, external_);
    add_reaction_work(plant, v, reaction_, external_, 1.0, ledger);
  }

  // External torques on the joints at the end of the correction.
  template <class Z>
  void find_external(const PlantT& plant, const Z& dz) {
    plant.find_external([&](std::size_t i) { return corrected_force(plant, i, dz); }, external_);
    for (int j = 0; j < plant.joints(); ++j)
      external_[j] += plant.stop[j].after(shift_[6 + j], right_[6 + j]) - plant.stop[j].torque;
  }

  // Force of a contact at the end of the correction.
  template <class Z>
  Vec3 corrected_force(const PlantT& plant, std::size_t i, const Z& dz) const {
    const FrozenContact& c = contacts_[i];
    Vec3 f = plant.feet[i].contact.force;
    if (!c.has_force) return f;
    f -= response(i).second;
    if (dz.size() > 0) f -= c.by_stretch * dz.template segment<3>(3 * i);
    return f;
  }

  // The displacement of the chart in the frame of the body.
  template <class Xi>
  void turn_into_body(const Xi& xi) {
    shift_ = xi;
    shift_.template head<3>() = chart_.linear.transpose() * xi.template head<3>();
    shift_.template segment<3>(3) = chart_.angular_inverse * xi.template segment<3>(3);
  }

  struct FrozenContact {
    bool has_force = false;
    Eigen::Matrix<double, 3, 6> jb, qb;
    LegJacobian jl, ql, left;  // `left`: jl with what gears leave of torques on the joints
    Vec3 n = Vec3::UnitZ(), k = Vec3::Zero(), k_effective = Vec3::Zero();
    Mat3 w = Mat3::Zero(), w_effective = Mat3::Zero();
    Mat3 by_stretch = Mat3::Zero();  // Z = -df/dz, N/m
    Mat3 bristle = Mat3::Identity();  // inverse of 1 - s dz'/dz
    double share = 0.0;               // s/c of the bristle
  };

  template <class Foot>
  static bool has_force(const Foot& foot) {
    return foot.active && foot.contact.minus_dz.squaredNorm() > 0.0;
  }

  void capture_contact(const PlantT& plant, std::size_t i) {
    FrozenContact& c = contacts_[i];
    const auto& foot = plant.feet[i];
    c.has_force = has_force(foot);
    c.n = foot.ground.normal;
    if (!c.has_force) return;
    c.jb = foot.jb, c.jl = c.left = foot.jl, c.qb = foot.qb, c.ql = foot.ql;
    if (plant.needs_external && !PlantT::kPrescribed) c.left = plant.left_by_gears(i, left_);
    c.w = c.w_effective = foot.contact.minus_du;
    c.k = c.k_effective = foot.contact.minus_dz;
  }

  // z' = (-P f - k P z)/c with P the contact plane and df = -W du - k_z dgap - Z dz, Z = (k/c) W P:
  // x_z = G (b_z + (s/c) P (W du + k_z dgap)), G^-1 = 1 + (s/c) P (k - Z), and the rest sees
  // (1 + (s/c) Z G P) (W, k_z) in the place of W, k_z.
  void eliminate_bristle(const PlantT& plant, FrozenContact& c) {
    const FrictionLaw& law = plant.law.friction;
    if (!law.has_bristle()) return;
    const double rate = law.bristle_relaxation();
    const Mat3 plane = Mat3::Identity() - c.n * c.n.transpose();
    c.share = s_ / law.bristle_damping;
    c.by_stretch = c.has_force ? Mat3(rate * c.w * plane) : Mat3(Mat3::Zero());
    c.bristle = (Mat3::Identity() + s_ * rate * plane - c.share * plane * c.by_stretch).inverse();
    if (!c.has_force) return;
    const Mat3 factor = Mat3::Identity() + c.share * c.by_stretch * c.bristle * plane;
    c.w_effective = factor * c.w;
    c.k_effective = factor * c.k;
  }

  template <class Z>
  void add_contact_load(std::size_t i, const Z& z) {
    const FrozenContact& c = contacts_[i];
    const Vec3 displaced = jacobian_times(i, c.jb, c.jl, shift_);
    const Vec3 turned = jacobian_times(i, c.qb, c.ql, shift_);
    Vec3 f = c.w_effective * turned + c.k_effective * c.n.dot(displaced);
    if (z.size() > 0) f += c.by_stretch * (c.bristle * z.template segment<3>(3 * i));
    right_.template head<6>().noalias() -= s_ * (c.jb.transpose() * f);
    for (std::size_t k = 0; k < columns_[i].size(); ++k)
      right_[Tree::column(columns_[i][k])] -= s_ * c.left.col(k).dot(f);
  }

  template <class Z>
  void solve_bristle(std::size_t i, Z& z) {
    const FrozenContact& c = contacts_[i];
    Vec3 b = z.template segment<3>(3 * i);
    if (c.has_force) {
      const Vec3 f = response(i).second;
      b += c.share * (f - c.n.dot(f) * c.n);
    }
    z.template segment<3>(3 * i) = c.bristle * b;
  }

  // du and W du + k_z dgap of the last solution
  std::pair<Vec3, Vec3> response(std::size_t i) const {
    const FrozenContact& c = contacts_[i];
    const Vec3 du = jacobian_times(i, c.jb, c.jl, right_) + jacobian_times(i, c.qb, c.ql, shift_);
    return {du, c.w * du + c.k * c.n.dot(jacobian_times(i, c.jb, c.jl, shift_))};
  }

  Vec3 jacobian_times(std::size_t i, const Eigen::Matrix<double, 3, 6>& xb, const LegJacobian& xl,
                      const VectorXd& x) const {
    Vec3 sum = xb * x.template head<6>();
    for (std::size_t k = 0; k < columns_[i].size(); ++k)
      sum += xl.col(k) * x[Tree::column(columns_[i][k])];
    return sum;
  }

  System system_;
  std::vector<FrozenContact> contacts_;
  std::vector<std::vector<std::size_t>> columns_;
  Eigen::MatrixXd mass_;
  VectorXd stiffness_, damping_;  // of drives, N m/rad and N m s/rad
  VectorXd left_;                 // what gears leave of a change of the external torque on a joint, -
  std::vector<char> lock_;        // joints that dry friction holds
  double s_ = 0.0;
  ChartMap chart_;
  VectorXd reaction_;       // of the last prescribed motion, N m
  VectorXd external_;       // torques on the joints at the end of the last correction, N m
  VectorXd right_, shift_;  // of the last solution: change of v, displacement in the body's frame
  VectorXd force_;          // of `add_force`, N and N m
  bool has_force_ = false;
};

}  // namespace hexapod
