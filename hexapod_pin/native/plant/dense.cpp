#include "plant/dense.hpp"

#include <stdexcept>

namespace hexapod {

void solve_dense(Eigen::MatrixXd& m, Eigen::VectorXd& x) {
  x = Eigen::PartialPivLU<Eigen::Ref<Eigen::MatrixXd>>(m).solve(x).eval();
}

DenseSystem::DenseSystem(const Tree& tree, const std::vector<FootMount>& feet)
    : matrix_(tree.nv, tree.nv) {
  for (const FootMount& foot : feet) {
    std::vector<int> columns;
    for (std::size_t j : tree.chain_to(foot.joint)) columns.push_back(int(Tree::column(j)));
    if (columns.size() > kMaxColumns)
      throw std::invalid_argument("a foot's chain has more than 16 joints");
    columns_.push_back(columns);
  }
}

std::vector<std::size_t> DenseSystem::columns(const Tree& tree, const FootMount& foot) const {
  return tree.chain_to(foot.joint);
}

void DenseSystem::load(const Eigen::MatrixXd& upper) {
  matrix_ = upper.selfadjointView<Eigen::Upper>();
}

void DenseSystem::add_foot(int foot, const BaseJacobian& jb, const LegJacobian& jl, const BaseJacobian& xb,
                           const LegJacobian& xl) {
  matrix_.topLeftCorner<6, 6>() += jb.transpose() * xb;
  const std::vector<int>& c = columns_[foot];
  for (std::size_t k = 0; k < c.size(); ++k) {
    matrix_.block<6, 1>(0, c[k]) += jb.transpose() * xl.col(k);
    matrix_.block<1, 6>(c[k], 0) += jl.col(k).transpose() * xb;
    for (std::size_t m = 0; m < c.size(); ++m) matrix_(c[k], c[m]) += jl.col(k).dot(xl.col(m));
  }
}

void DenseSystem::factor() {
  lu_.compute(matrix_);
}

void DenseSystem::solve(Eigen::VectorXd& b) const {
  b = lu_.solve(b).eval();
}

}  // namespace hexapod
