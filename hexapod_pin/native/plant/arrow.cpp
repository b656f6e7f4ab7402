#include "plant/arrow.hpp"

#include <Eigen/LU>

namespace hexapod {

ArrowSystem::ArrowSystem(const Tree& tree, const std::vector<FootMount>& feet)
    : legs_((tree.joints - 2) / 3) {
  for (const FootMount& foot : feet) leg_of_.push_back(foot.joint < 2 ? -1 : int(foot.joint - 2) / 3);
}

std::vector<std::size_t> ArrowSystem::columns(const Tree& /*tree*/, const FootMount& foot) const {
  if (foot.joint < 2) return {};
  const std::size_t first = 2 + (foot.joint - 2) / 3 * 3;
  return {first, first + 1, first + 2};
}

void ArrowSystem::load(const Eigen::MatrixXd& upper) {
  base_ = upper.topLeftCorner<6, 6>().selfadjointView<Eigen::Upper>();
  for (std::size_t i = 0; i < legs_.size(); ++i) {
    const int c = 6 + 3 * int(i);
    legs_[i].u = upper.block<6, 3>(0, c);
    legs_[i].l = legs_[i].u.transpose();
    legs_[i].g = upper.block<3, 3>(c, c).selfadjointView<Eigen::Upper>();
  }
}

// Products of this size are a call each where the compiler does not inline them.
[[gnu::flatten]] void ArrowSystem::add_foot(int foot, const BaseJacobian& jb, const LegJacobian& jl,
                                            const BaseJacobian& xb, const LegJacobian& xl) {
  const Eigen::Matrix<double, 6, 3> jbt = jb.transpose();  // columns of six: whole SIMD lanes
  base_.noalias() += jbt.lazyProduct(xb);
  if (leg_of_[foot] < 0) return;
  LegBlocks& leg = legs_[leg_of_[foot]];
  leg.u.noalias() += jbt.lazyProduct(xl);
  leg.l.noalias() += jl.transpose().lazyProduct(xb);
  leg.g.noalias() += jl.transpose().lazyProduct(xl);
}

void ArrowSystem::factor() {
  for (LegBlocks& leg : legs_) {
    leg.g_inverse = leg.g.inverse();
    leg.w.noalias() = leg.g_inverse.lazyProduct(leg.l);
    base_.noalias() -= leg.u.lazyProduct(leg.w);
  }
  factor_lu(base_);
}

void ArrowSystem::solve(Eigen::VectorXd& b) const {
  Vec6 x = b.head<6>();
  for (std::size_t i = 0; i < legs_.size(); ++i) {
    auto y = b.segment<3>(6 + 3 * i);
    const Eigen::Vector3d z = legs_[i].g_inverse * y;
    y = z;
    x.noalias() -= legs_[i].u.lazyProduct(z);
  }
  solve_lu(base_, x);
  b.head<6>() = x;
  for (std::size_t i = 0; i < legs_.size(); ++i)
    b.segment<3>(6 + 3 * i).noalias() -= legs_[i].w.lazyProduct(x);
}

}  // namespace hexapod
