// Linear system of a robot whose joints follow a given motion: the six equations of the base alone,
//   (M_bb + ...) a_b = f_b - M_bj a_j.
#pragma once

#include <stdexcept>
#include <vector>

#include <Eigen/Core>

#include "plant/arrow.hpp"
#include "plant/dense.hpp"

namespace hexapod {

class PrescribedSystem {
 public:
  static constexpr bool kPrescribed = true;
  static constexpr int kLegColumns = Eigen::Dynamic;
  using LegJacobian = DenseSystem::LegJacobian;

  PrescribedSystem(const Tree& tree, const std::vector<FootMount>& feet) : coupling_(6, tree.nv - 6) {
    for (const FootMount& foot : feet) require_short_chain(tree.chain_to(foot.joint).size());
  }

  std::vector<std::size_t> columns(const Tree& tree, const FootMount& foot) const {
    return tree.chain_to(foot.joint);
  }

  void load(const Eigen::MatrixXd& upper) {
    base_ = upper.topLeftCorner<6, 6>().selfadjointView<Eigen::Upper>();
    coupling_ = upper.topRightCorner(6, coupling_.cols());
  }

  void add_diagonal(int, double) {}  // joints have no equations

  template <class Jb, class Jl, class Xb, class Xl>
  void add_foot(int, const Jb& jb, const Jl&, const Xb& xb, const Xl&) {
    base_.noalias() += jb.transpose().lazyProduct(xb);
  }

  void factor() { factor6(base_); }

  // b: forces on the base, then the accelerations of the joints, which stay; becomes the accelerations.
  void solve(Eigen::VectorXd& b) const {
    Vec6 x = b.head<6>() - coupling_ * b.tail(coupling_.cols());
    solve6(base_, x);
    b.head<6>() = x;
  }

 private:
  static void require_short_chain(std::size_t joints) {
    if (joints > std::size_t(DenseSystem::kMaxColumns))
      throw std::invalid_argument("a foot's chain has more than 16 joints");
  }

  Mat6 base_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> coupling_;
};

}  // namespace hexapod
