// A step's system with the legs eliminated: (M + w D + w h K) dv = r + sum J^T lambda, reduced
// to the base alone, and the back-substitution for the joints. M's upper triangle is that of the plant.
#pragma once

#include <algorithm>
#include <vector>

#include "robust/impulse_problem.hpp"

namespace hexapod {

class LegElimination {
 public:
  explicit LegElimination(std::size_t legs) : legs_(legs) {}

  // Legs start free; a kept one stays in the system with its joints.
  void keep_none() {
    for (EliminatedLeg& leg : legs_) leg.kept = -1;
    kept_ = 0;
  }
  void keep(std::size_t leg) {
    if (legs_[leg].kept < 0) legs_[leg].kept = 6 + 3 * kept_++;
  }
  bool keeps_any() const { return kept_ > 0; }

  // `diagonal` adds to M's diagonal at the joints, `right` is r.
  void load(const Eigen::MatrixXd& upper, const VectorXd& diagonal, const VectorXd& right) {
    base_ = upper.topLeftCorner<6, 6>().selfadjointView<Eigen::Upper>();
    base_right_ = right.head<6>();
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      const int c = 6 + 3 * int(i);
      EliminatedLeg& leg = legs_[i];
      leg.block = upper.block<3, 3>(c, c).selfadjointView<Eigen::Upper>();
      leg.block.diagonal() += diagonal.segment<3>(3 * i);
      leg.inverse = leg.block.inverse();
      leg.coupling = upper.block<6, 3>(0, c);
      leg.right = right.segment<3>(c);
      if (leg.kept >= 0) continue;
      leg.free.noalias() = leg.inverse * leg.right;
      leg.gain.noalias() = leg.coupling.lazyProduct(leg.inverse);
      base_.noalias() -= leg.gain.lazyProduct(leg.coupling.transpose());
      base_right_.noalias() -= leg.coupling * leg.free;
    }
  }

  // The base alone, its joints changing their rates by `change`.
  void load_base(const Eigen::MatrixXd& upper, const VectorXd& change, const VectorXd& right) {
    base_ = upper.topLeftCorner<6, 6>().selfadjointView<Eigen::Upper>();
    base_right_ = right.head<6>() - upper.topRightCorner(6, change.size()) * change;
  }

  // -l x dv_angular on the left: the base turns about its angular momentum without a change of energy.
  void add_gyroscopic(const Vec3& l) {
    base_(3, 4) += l.z(), base_(4, 3) -= l.z();
    base_(3, 5) -= l.y(), base_(5, 3) += l.y();
    base_(4, 5) += l.x(), base_(5, 4) -= l.x();
  }

  template <int N>
  void fill(ImpulseProblem<N>& p) const {
    if constexpr (N == 6) {
      p.s = base_;
      p.b = base_right_;
    } else {
      const int size = 6 + 3 * kept_;
      p.s.setZero(size, size);
      p.b.setZero(size);
      p.s.template topLeftCorner<6, 6>() = base_;
      p.b.template head<6>() = base_right_;
      for (const EliminatedLeg& leg : legs_) {
        if (leg.kept < 0) continue;
        p.s.template block<6, 3>(0, leg.kept) = leg.coupling;
        p.s.template block<3, 6>(leg.kept, 0) = leg.coupling.transpose();
        p.s.template block<3, 3>(leg.kept, leg.kept) = leg.block;
        p.b.template segment<3>(leg.kept) = leg.right;
      }
    }
  }

  // Jacobian, compliance and free velocity of a contact with Jacobians jb, jl (world axes); leg < 0:
  // on the base.
  template <int N>
  void place(int leg, const Eigen::Matrix<double, 3, 6>& jb, const Mat3& jl, int size,
             StepContact<N>& c) const {
    if constexpr (N != 6) c.jt.setZero(size, 3);
    c.jt.template topRows<6>() = jb.transpose();
    c.foot.g.setZero();
    c.free = c.start;
    if (leg < 0) return;
    const EliminatedLeg& l = legs_[leg];
    if (l.kept >= 0) {
      if constexpr (N != 6) c.jt.template middleRows<3>(l.kept) = jl.transpose();
      return;
    }
    const Mat3 jlt = jl.transpose();
    c.jt.template topRows<6>().noalias() -= l.gain.lazyProduct(jlt);
    c.foot.g.noalias() = jl.lazyProduct(l.inverse.lazyProduct(jlt).eval());
    c.free.noalias() += jl * l.free;
  }

  // dv of everything from the solved problem; `leg_impulse` is J_l^T lambda, summed per leg.
  template <int N>
  void restore(const ImpulseProblem<N>& p, const std::vector<Vec3>& leg_impulse, VectorXd& dv) const {
    dv.head<6>() = p.v.template head<6>();
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      const EliminatedLeg& leg = legs_[i];
      if (leg.kept >= 0) {
        dv.segment<3>(6 + 3 * i) = p.v.template segment<3>(leg.kept);
      } else {
        dv.segment<3>(6 + 3 * i) = leg.free + leg.inverse * leg_impulse[i] -
                                   leg.gain.transpose() * dv.head<6>();
      }
    }
  }

 private:
  struct EliminatedLeg {
    Mat3 block, inverse;
    Eigen::Matrix<double, 6, 3> coupling, gain;  // B, B A^-1
    Vec3 right, free;
    int kept = -1;  // first row in the system, -1: eliminated
  };
  Mat6 base_;
  Vec6 base_right_;
  std::vector<EliminatedLeg> legs_;
  int kept_ = 0;
};

}  // namespace hexapod
