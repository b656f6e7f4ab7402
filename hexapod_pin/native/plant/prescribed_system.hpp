// Linear system of a robot whose joints follow a given motion: the six equations of the base alone,
//   (M_bb + ...) a_b = f_b - M_bj a_j.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "plant/dense.hpp"

namespace hexapod {

class PrescribedSystem {
 public:
  static constexpr bool kPrescribed = true;
  static constexpr int kLegColumns = Eigen::Dynamic;
  using LegJacobian = DenseSystem::LegJacobian;

  PrescribedSystem(const Tree& tree, const std::vector<FootMount>& feet);

  std::vector<std::size_t> columns(const Tree& tree, const FootMount& foot) const;

  void load(const Eigen::MatrixXd& upper);

  void add_diagonal(int, double) {}  // joints have no equations

  void add_foot(int foot, const BaseJacobian& jb, const LegJacobian& jl, const BaseJacobian& xb,
                const LegJacobian& xl);

  void factor();

  // b: forces on the base, then the accelerations of the joints, which stay; becomes the accelerations.
  void solve(Eigen::VectorXd& b) const;

 private:
  Mat6 base_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> coupling_;
};

}  // namespace hexapod
