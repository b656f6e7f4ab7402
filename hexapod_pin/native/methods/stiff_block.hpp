// The stiff part of y' = f(y) frozen at an evaluated state, and (I - sJ) x = b with it. Contacts are
// complete (their coupling, their friction, the turning of the contact point), servos and stops too;
// Coriolis, gravity and the configuration's pull on M are left out:
//   (M + sD + s^2 K) x_v = M b_v - s K b_xi,  x_xi = b_xi + s x_v,
// in the frame of the body; the chart's own map stands before and after. Bristles are eliminated.
#pragma once

#include <utility>
#include <vector>

#include "plant/plant.hpp"

namespace hexapod {

struct PlantSettings;

struct ChartRates {
  VectorXd slope;     // y' of y = (xi, v, z) in the chart of q0
  VectorXd solution;  // x of (I - sJ) x = b with the stiff block there
};

// The two at one state under held set-points, for whoever wants to compare them (ndf.cpp).
ChartRates chart_rates(const PlantSettings& settings, const VectorXd& q0, const VectorXd& y,
                       const VectorXd& q_ref, double s, const VectorXd& b);

template <class PlantT>
class StiffBlock {
  using System = typename PlantT::System;
  using LegJacobian = typename System::LegJacobian;

 public:
  explicit StiffBlock(const PlantT& plant)
      : system_(plant.system), contacts_(plant.feet.size()), stiffness_(plant.joints()),
        damping_(plant.joints()), saturated_(plant.joints(), 0), probe_(plant.tree.nv),
        rate_(plant.tree.nv), right_(plant.tree.nv), shift_(plant.tree.nv) {
    for (const FootMount& mount : plant.mounts)
      for (std::size_t k = 0; k < plant.per_foot; ++k)
        columns_.push_back(plant.system.columns(plant.tree, mount));
  }

  // The plant has been evaluated at chart coordinates xi with the servos' wanted torques.
  template <class Xi>
  void capture(const PlantT& plant, const Xi& xi, const VectorXd& wanted) {
    mass_ = plant.mass_upper();
    for (std::size_t i = 0; i < contacts_.size(); ++i) capture_contact(plant, i);
    for (int j = 0; j < plant.joints(); ++j) {
      const Servo& servo = plant.servo;
      saturated_[j] = side(servo, j, wanted[j]);
      stiffness_[j] = plant.stop[j].stiffness + (saturated_[j] ? 0.0 : servo.kp[j]);
      damping_[j] = plant.stop[j].damping + servo.damping[j] + (saturated_[j] ? 0.0 : servo.kd[j]);
    }
    capture_chart(xi);
  }

  // Whether the same contacts push and the same servos are at their limits.
  bool fits(const PlantT& plant, const VectorXd& wanted) const {
    for (std::size_t i = 0; i < contacts_.size(); ++i)
      if (contacts_[i].pushes != pushes(plant.feet[i])) return false;
    for (int j = 0; j < plant.joints(); ++j)
      if (saturated_[j] != side(plant.servo, j, wanted[j])) return false;
    return true;
  }

  void factor(const PlantT& plant, double s) {
    s_ = s;
    system_.load(mass_);
    for (int j = 0; j < plant.joints(); ++j)
      system_.add_diagonal(j, s * (damping_[j] + s * stiffness_[j]));
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      Contact& c = contacts_[i];
      eliminate_bristle(plant, c);
      if (!c.pushes) continue;
      const Vec3 k = (s * s) * c.k_whole;
      Eigen::Matrix<double, 3, 6> xb = c.w_whole.lazyProduct(s * (c.jb + s * c.qb));
      LegJacobian xl = c.w_whole.lazyProduct(s * (c.jl + s * c.ql));
      xb.noalias() += k * (c.n.transpose() * c.jb);
      xl.noalias() += k * (c.n.transpose() * c.jl);
      system_.add_foot(int(plant.foot_of(i)), c.jb, c.jl, xb, xl);
    }
    system_.factor();
  }

  // b becomes x; bristles z may be empty.
  template <class Xi, class V, class Z>
  void solve(Xi xi, V v, Z z) {
    shift_ = xi;
    shift_.template head<3>() = turn_.transpose() * xi.template head<3>();
    shift_.template segment<3>(3) = turning_inverse_ * xi.template segment<3>(3);
    right_.noalias() = mass_.template selfadjointView<Eigen::Upper>() * v;
    right_.tail(stiffness_.size()) -= s_ * stiffness_.cwiseProduct(shift_.tail(stiffness_.size()));
    for (std::size_t i = 0; i < contacts_.size(); ++i)
      if (contacts_[i].pushes) push_back(i, z);
    system_.solve(right_);
    v = right_;
    shift_ += s_ * right_;
    xi = shift_;
    xi.template head<3>() = turn_ * shift_.template head<3>();
    xi.template segment<3>(3) = turning_ * shift_.template segment<3>(3);
    for (std::size_t i = 0; i < std::size_t(z.size()) / 3; ++i) solve_bristle(i, z);
  }

  // Adds the powers at the end of the correction last solved for: state and forces as evaluated, the
  // changes as the frozen laws give them. `wanted` torques and bristles' changes dz as above.
  template <class Z>
  void add_power(const PlantT& plant, const VectorXd& v, const VectorXd& wanted, const Z& dz,
                 EnergyLedger& ledger) const {
    const Servo& servo = plant.servo;
    for (int j = 0; j < plant.joints(); ++j) {
      const double turn = shift_[6 + j], change = right_[6 + j], rate = v[6 + j] + change;
      const double pd = wanted[j] - servo.kp[j] * turn - servo.kd[j] * change;
      const StopPush& stop = plant.stop[j];
      ledger.servo += servo.clip(j, pd) * rate;
      ledger.joint_damping += servo.damping[j] * rate * rate;
      ledger.stops -= (stop.torque - stop.stiffness * turn - stop.damping * change) * rate;
    }
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      const Contact& c = contacts_[i];
      if (!c.pushes) continue;
      const auto [change, pushed] = moved(i);
      Vec3 f = plant.feet[i].contact.force - pushed;
      if (dz.size() > 0) f -= c.by_stretch * dz.template segment<3>(3 * i);
      ledger.add_contact(i, f, plant.feet[i].velocity + change, c.n, 1.0);
    }
  }

 private:
  struct Contact {
    bool pushes = false;
    Eigen::Matrix<double, 3, 6> jb, qb;
    LegJacobian jl, ql;
    Vec3 n = Vec3::UnitZ(), k = Vec3::Zero(), k_whole = Vec3::Zero();
    Mat3 w = Mat3::Zero(), w_whole = Mat3::Zero();
    Mat3 by_stretch = Mat3::Zero();  // Z = -df/dz, N/m
    Mat3 bristle = Mat3::Identity();  // inverse of 1 - s dz'/dz
    double share = 0.0;               // s/c of the bristle
  };

  template <class Foot>
  static bool pushes(const Foot& foot) {
    return foot.active && foot.contact.minus_dz.squaredNorm() > 0.0;
  }

  static int side(const Servo& servo, int j, double wanted) {
    return wanted > servo.limit[j] ? 1 : wanted < -servo.limit[j] ? -1 : 0;
  }

  void capture_contact(const PlantT& plant, std::size_t i) {
    Contact& c = contacts_[i];
    const auto& foot = plant.feet[i];
    c.pushes = pushes(foot);
    c.n = foot.ground.normal;
    if (!c.pushes) return;
    c.jb = foot.jb, c.jl = foot.jl, c.qb = foot.qb, c.ql = foot.ql;
    c.w = c.w_whole = foot.contact.minus_du;
    c.k = c.k_whole = foot.contact.minus_dz;
  }

  template <class Xi>
  void capture_chart(const Xi& xi) {
    probe_.setZero();
    const VectorXd at = xi;
    for (int k = 0; k < 3; ++k) {
      probe_[3 + k] = 1.0;
      chart_rate(at, probe_, rate_);
      turning_.col(k) = rate_.template segment<3>(3);
      probe_[3 + k] = 0.0;
    }
    turn_ = exp_quaternion(at.template segment<3>(3)).toRotationMatrix();
    turning_inverse_ = turning_.inverse();
  }

  // z' = (-P f - k P z)/c with P the contact plane and df = -W du - k_z dgap - Z dz, Z = (k/c) W P:
  // x_z = G (b_z + (s/c) P (W du + k_z dgap)), G^-1 = 1 + (s/c) P (k - Z), and the rest sees
  // (1 + (s/c) Z G P) (W, k_z) in the place of W, k_z.
  void eliminate_bristle(const PlantT& plant, Contact& c) {
    const FrictionLaw& law = plant.law.friction;
    if (law.kind != FrictionKind::bristle) return;
    const double rate = law.bristle_stiffness / law.bristle_damping;
    const Mat3 plane = Mat3::Identity() - c.n * c.n.transpose();
    c.share = s_ / law.bristle_damping;
    c.by_stretch = c.pushes ? Mat3(rate * c.w * plane) : Mat3(Mat3::Zero());
    c.bristle = (Mat3::Identity() + s_ * rate * plane - c.share * plane * c.by_stretch).inverse();
    if (!c.pushes) return;
    const Mat3 whole = Mat3::Identity() + c.share * c.by_stretch * c.bristle * plane;
    c.w_whole = whole * c.w;
    c.k_whole = whole * c.k;
  }

  template <class Z>
  void push_back(std::size_t i, const Z& z) {
    const Contact& c = contacts_[i];
    const Vec3 moved = along(i, c.jb, c.jl, shift_), turned = along(i, c.qb, c.ql, shift_);
    Vec3 f = c.w_whole * turned + c.k_whole * c.n.dot(moved);
    if (z.size() > 0) f += c.by_stretch * (c.bristle * z.template segment<3>(3 * i));
    right_.template head<6>().noalias() -= s_ * (c.jb.transpose() * f);
    for (std::size_t k = 0; k < columns_[i].size(); ++k)
      right_[Tree::column(columns_[i][k])] -= s_ * c.jl.col(k).dot(f);
  }

  template <class Z>
  void solve_bristle(std::size_t i, Z& z) {
    const Contact& c = contacts_[i];
    Vec3 b = z.template segment<3>(3 * i);
    if (c.pushes) {
      const Vec3 f = moved(i).second;
      b += c.share * (f - c.n.dot(f) * c.n);
    }
    z.template segment<3>(3 * i) = c.bristle * b;
  }

  // du and W du + k_z dgap of the last solution
  std::pair<Vec3, Vec3> moved(std::size_t i) const {
    const Contact& c = contacts_[i];
    const Vec3 du = along(i, c.jb, c.jl, right_) + along(i, c.qb, c.ql, shift_);
    return {du, c.w * du + c.k * c.n.dot(along(i, c.jb, c.jl, shift_))};
  }

  Vec3 along(std::size_t i, const Eigen::Matrix<double, 3, 6>& xb, const LegJacobian& xl,
             const VectorXd& x) const {
    Vec3 sum = xb * x.template head<6>();
    for (std::size_t k = 0; k < columns_[i].size(); ++k)
      sum += xl.col(k) * x[Tree::column(columns_[i][k])];
    return sum;
  }

  System system_;
  std::vector<Contact> contacts_;
  std::vector<std::vector<std::size_t>> columns_;
  Eigen::MatrixXd mass_;
  VectorXd stiffness_, damping_;  // of servos and stops, N m/rad and N m s/rad
  std::vector<int> saturated_;    // servo at its limit: its sign
  double s_ = 0.0;
  Mat3 turn_, turning_, turning_inverse_;  // xi' = turn v, phi' = turning w
  VectorXd probe_, rate_, right_, shift_;
};

}  // namespace hexapod
