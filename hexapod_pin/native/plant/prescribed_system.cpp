#include "plant/prescribed_system.hpp"

#include <stdexcept>

#include "plant/arrow.hpp"

namespace hexapod {

PrescribedSystem::PrescribedSystem(const Tree& tree, const std::vector<FootMount>& feet)
    : coupling_(6, tree.nv - 6) {
  for (const FootMount& foot : feet)
    if (tree.chain_to(foot.joint).size() > std::size_t(DenseSystem::kMaxColumns))
      throw std::invalid_argument("a foot's chain has more than 16 joints");
}

std::vector<std::size_t> PrescribedSystem::columns(const Tree& tree, const FootMount& foot) const {
  return tree.chain_to(foot.joint);
}

void PrescribedSystem::load(const Eigen::MatrixXd& upper) {
  base_ = upper.topLeftCorner<6, 6>().selfadjointView<Eigen::Upper>();
  coupling_ = upper.topRightCorner(6, coupling_.cols());
}

void PrescribedSystem::add_foot(int /*foot*/, const BaseJacobian& jb, const LegJacobian& /*jl*/,
                                const BaseJacobian& xb, const LegJacobian& /*xl*/) {
  base_.noalias() += jb.transpose().lazyProduct(xb);
}

void PrescribedSystem::factor() { factor_lu(base_); }

void PrescribedSystem::solve(Eigen::VectorXd& b) const {
  Vec6 x = b.head<6>() - coupling_ * b.tail(coupling_.cols());
  solve_lu(base_, x);
  b.head<6>() = x;
}

}  // namespace hexapod
