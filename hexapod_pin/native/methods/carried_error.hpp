// The error of a run, found while it runs: what each step may have lost moves along with the linearised
// motion, e <- (I - h J)^-1 e + local error, through contacts and drives as the stiff block has them.
// Coriolis forces are not among them: what flies and spins is not followed.
#pragma once

#include "methods/chart_flow.hpp"
#include "methods/stiff_block.hpp"

namespace hexapod {

template <class PlantT>
class CarriedError {
 public:
  explicit CarriedError(const ChartFlow<PlantT>& flow)
      : block_(flow.plant), error_(VectorXd::Zero(flow.size())) {}

  // A step of h [s] with this local error has ended at y, where the plant has been evaluated.
  void add(ChartFlow<PlantT>& flow, const VectorXd& y, const VectorXd& local, double h) {
    block_.capture(flow.plant, flow.xi(y));
    block_.factor(flow.plant, h);
    block_.solve(flow.xi(error_), flow.v(error_), flow.z(error_));
    const Eigen::Index states = error_.size() - flow.nw;
    error_.head(states) += local.head(states);
  }

  // What it changes a contact's force by, at most, N: as the laws at the end of the last step have it.
  double largest_force_change(const ChartFlow<PlantT>& flow) {
    return block_.largest_force_change(flow.xi(error_), flow.v(error_), flow.z(error_));
  }

  // The chart's origin moves to y.
  void move_chart(ChartFlow<PlantT>& flow, const VectorXd& y) {
    chart_.capture(flow.xi(y).template segment<3>(3));
    auto xi = flow.xi(error_);
    xi.template head<3>() = (chart_.linear.transpose() * xi.template head<3>()).eval();
    xi.template segment<3>(3) = (chart_.angular_inverse * xi.template segment<3>(3)).eval();
  }

  // Whether it is a number that a linearised motion can follow: up to 1 m, rad, m/s and rad/s.
  bool small() const { return error_.allFinite() && error_.cwiseAbs().maxCoeff() <= 1.0; }
  void clear() { error_.setZero(); }

  // y with the error added
  void displace(const VectorXd& y, VectorXd& displaced) const { displaced = y + error_; }

 private:
  StiffBlock<PlantT> block_;
  ChartMap chart_;
  VectorXd error_;  // its works are 0
};

}  // namespace hexapod
