// The same linear system for any other tree: dense LU with partial pivoting.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>

#include "plant/dynamics.hpp"
#include "plant/mount.hpp"

namespace hexapod {

class DenseSystem {
 public:
  static constexpr bool kPrescribed = false;
  static constexpr int kLegColumns = Eigen::Dynamic;
  static constexpr int kMaxColumns = 16;
  using LegJacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxColumns>;

  DenseSystem(const Tree& tree, const std::vector<FootMount>& feet)
      : matrix_(tree.nv, tree.nv) {
    for (const FootMount& foot : feet) {
      std::vector<int> columns;
      for (std::size_t j : tree.chain_to(foot.joint)) columns.push_back(int(Tree::column(j)));
      if (columns.size() > kMaxColumns)
        throw std::invalid_argument("a foot's chain has more than 16 joints");
      columns_.push_back(columns);
    }
  }

  std::vector<std::size_t> columns(const Tree& tree, const FootMount& foot) const {
    return tree.chain_to(foot.joint);
  }

  void load(const Eigen::MatrixXd& upper) { matrix_ = upper.selfadjointView<Eigen::Upper>(); }

  void add_diagonal(int joint, double value) { matrix_(6 + joint, 6 + joint) += value; }

  template <class Jb, class Jl, class Xb, class Xl>
  void add_foot(int foot, const Jb& jb, const Jl& jl, const Xb& xb, const Xl& xl) {
    matrix_.topLeftCorner<6, 6>() += jb.transpose() * xb;
    const std::vector<int>& c = columns_[foot];
    for (std::size_t k = 0; k < c.size(); ++k) {
      matrix_.block<6, 1>(0, c[k]) += jb.transpose() * xl.col(k);
      matrix_.block<1, 6>(c[k], 0) += jl.col(k).transpose() * xb;
      for (std::size_t m = 0; m < c.size(); ++m) matrix_(c[k], c[m]) += jl.col(k).dot(xl.col(m));
    }
  }

  void factor() { lu_.compute(matrix_); }
  void solve(Eigen::VectorXd& b) const { b = lu_.solve(b).eval(); }

 private:
  Eigen::MatrixXd matrix_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  std::vector<std::vector<int>> columns_;
};

}  // namespace hexapod
