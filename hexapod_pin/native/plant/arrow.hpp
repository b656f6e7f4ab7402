// Nonsymmetric block-arrow LU: a 6x6 base block with three-joint legs attached,
//   [B U1 U2 ..; L1 G1 0 ..; L2 0 G2 ..], the sparsity of M + hD + h^2 K for feet on legs.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>

#include "laws/vectors.hpp"
#include "plant/dynamics.hpp"
#include "plant/mount.hpp"

namespace hexapod {

// In-place LU of a 6x6 without pivoting (diagonally dominant by the inertia), and its solve.
inline void factor6(Mat6& a) {
  for (int k = 0; k < 6; ++k) {
    const double inverse = 1.0 / a(k, k);
    for (int i = k + 1; i < 6; ++i) a(i, k) *= inverse;
    for (int j = k + 1; j < 6; ++j)
      for (int i = k + 1; i < 6; ++i) a(i, j) -= a(i, k) * a(k, j);
  }
}

inline void solve6(const Mat6& lu, Vec6& x) {
  for (int k = 0; k < 6; ++k)
    for (int i = k + 1; i < 6; ++i) x[i] -= lu(i, k) * x[k];
  for (int k = 5; k >= 0; --k) {
    x[k] /= lu(k, k);
    for (int i = 0; i < k; ++i) x[i] -= lu(i, k) * x[k];
  }
}

class ArrowSystem {
 public:
  static constexpr bool kPrescribed = false;
  static constexpr int kLegColumns = 3;
  using LegJacobian = Eigen::Matrix<double, 3, 3>;

  ArrowSystem(const Tree& tree, const std::vector<FootMount>& feet)
      : legs_((tree.joints - 2) / 3) {
    for (const FootMount& foot : feet) leg_of_.push_back(foot.joint < 2 ? -1 : int(foot.joint - 2) / 3);
  }

  // columns of a foot's leg Jacobian: the joints of its leg, those beyond the foot being zero
  std::vector<std::size_t> columns(const Tree&, const FootMount& foot) const {
    if (foot.joint < 2) return {};
    const std::size_t first = 2 + (foot.joint - 2) / 3 * 3;
    return {first, first + 1, first + 2};
  }

  void load(const Eigen::MatrixXd& upper) {
    base_ = upper.topLeftCorner<6, 6>().selfadjointView<Eigen::Upper>();
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      const int c = 6 + 3 * int(i);
      legs_[i].u = upper.block<6, 3>(0, c);
      legs_[i].l = legs_[i].u.transpose();
      legs_[i].g = upper.block<3, 3>(c, c).selfadjointView<Eigen::Upper>();
    }
  }

  void add_diagonal(int joint, double value) { legs_[joint / 3].g(joint % 3, joint % 3) += value; }

  // Products of this size are a call each where the compiler does not inline them.
  template <class Jb, class Jl, class Xb, class Xl>
  [[gnu::flatten]] void add_foot(int foot, const Jb& jb, const Jl& jl, const Xb& xb, const Xl& xl) {
    const Eigen::Matrix<double, 6, 3> jbt = jb.transpose();  // columns of six: whole SIMD lanes
    base_.noalias() += jbt.lazyProduct(xb);
    if (leg_of_[foot] < 0) return;
    LegBlocks& leg = legs_[leg_of_[foot]];
    leg.u.noalias() += jbt.lazyProduct(xl);
    leg.l.noalias() += jl.transpose().lazyProduct(xb);
    leg.g.noalias() += jl.transpose().lazyProduct(xl);
  }

  void factor() {
    for (LegBlocks& leg : legs_) {
      leg.g_inverse = leg.g.inverse();
      leg.w.noalias() = leg.g_inverse.lazyProduct(leg.l);
      base_.noalias() -= leg.u.lazyProduct(leg.w);
    }
    factor6(base_);
  }

  void solve(Eigen::VectorXd& b) const {
    Vec6 x = b.head<6>();
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      auto y = b.segment<3>(6 + 3 * i);
      const Eigen::Vector3d z = legs_[i].g_inverse * y;
      y = z;
      x.noalias() -= legs_[i].u.lazyProduct(z);
    }
    solve6(base_, x);
    b.head<6>() = x;
    for (std::size_t i = 0; i < legs_.size(); ++i)
      b.segment<3>(6 + 3 * i).noalias() -= legs_[i].w.lazyProduct(x);
  }

 private:
  struct LegBlocks {
    Eigen::Matrix<double, 6, 3> u;
    Eigen::Matrix<double, 3, 6> l, w;
    Eigen::Matrix3d g, g_inverse;
  };
  Mat6 base_;
  std::vector<LegBlocks> legs_;
  std::vector<int> leg_of_;
};

}  // namespace hexapod
