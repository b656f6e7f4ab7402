// Nonsymmetric block-arrow LU: a 6x6 base block with three-joint legs attached,
//   [B U1 U2 ..; L1 G1 0 ..; L2 0 G2 ..], the sparsity of M + hD + h^2 K for feet on legs.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "laws/vectors.hpp"
#include "plant/dynamics.hpp"
#include "plant/mount.hpp"
#include "plant/small_lu.hpp"

namespace hexapod {

class ArrowSystem {
 public:
  static constexpr bool kPrescribed = false;
  static constexpr int kLegColumns = 3;
  using LegJacobian = Eigen::Matrix<double, 3, 3>;

  ArrowSystem(const Tree& tree, const std::vector<FootMount>& feet);

  // columns of a foot's leg Jacobian: the joints of its leg, those beyond the foot being zero
  std::vector<std::size_t> columns(const Tree&, const FootMount& foot) const;

  void load(const Eigen::MatrixXd& upper);

  void add_diagonal(int joint, double value) { legs_[joint / 3].g(joint % 3, joint % 3) += value; }

  void add_foot(int foot, const BaseJacobian& jb, const LegJacobian& jl, const BaseJacobian& xb,
                const LegJacobian& xl);

  void factor();

  void solve(Eigen::VectorXd& b) const;

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
