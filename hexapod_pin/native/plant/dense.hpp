// The same linear system for any other tree: dense LU with partial pivoting.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>

#include "plant/dynamics.hpp"
#include "plant/mount.hpp"

namespace hexapod {

// Solves m x = x in place by the same LU; the matrix is overwritten.
void solve_dense(Eigen::MatrixXd& m, Eigen::VectorXd& x);

class DenseSystem {
 public:
  static constexpr bool kPrescribed = false;
  static constexpr int kLegColumns = Eigen::Dynamic;
  static constexpr int kMaxColumns = 16;
  using LegJacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxColumns>;

  DenseSystem(const Tree& tree, const std::vector<FootMount>& feet);

  std::vector<std::size_t> columns(const Tree& tree, const FootMount& foot) const;

  void load(const Eigen::MatrixXd& upper);

  void add_diagonal(int joint, double value) { matrix_(6 + joint, 6 + joint) += value; }

  void add_foot(int foot, const BaseJacobian& jb, const LegJacobian& jl, const BaseJacobian& xb,
                const LegJacobian& xl);

  void factor();
  void solve(Eigen::VectorXd& b) const;

 private:
  Eigen::MatrixXd matrix_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  std::vector<std::vector<int>> columns_;
};

}  // namespace hexapod
