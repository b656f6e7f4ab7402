#include "kinematics/leg_search.hpp"

#include <Eigen/LU>
#include <limits>

#include "kinematics/bounded_least_squares.hpp"

namespace hexapod {

namespace {

constexpr double kMostChange = 0.2;   // rad; a Newton solution this far from the one before is solved again
constexpr int kNewtonSteps = 12;
constexpr double kLongestStep = 0.3;  // of one joint, rad
constexpr double kLastStep = 1e-9;    // rad; the step after one this short would be its square
constexpr double kNear = 1.0;         // rad; a Newton solution this near its start is taken as the nearest one
constexpr double kDamping = 1e-14;    // added to the diagonal of J^T J, m^2

}  // namespace

// The part of the way from the foot to a target that the leg can follow.
template <int J>
typename LegSearch<J>::Angles LegSearch<J>::missed(const Vec3& target, const Angles& q) const {
  return task_ * (target - chain_.pose(q).foot);
}

template <int J>
typename LegSearch<J>::Angles LegSearch<J>::newton(const Vec3& target, Angles q) const {
  using Square = Eigen::Matrix<double, J, J>;
  for (int count = 0; count < kNewtonSteps; ++count) {
    const ChainPose<J> at = chain_.pose(q);
    const Square jacobian = task_ * at.jacobian;
    const Square normal = jacobian.transpose() * jacobian + kDamping * Square::Identity();
    const Angles step = normal.inverse() * (jacobian.transpose() * (task_ * (target - at.foot)));
    q += step.cwiseMax(-kLongestStep).cwiseMin(kLongestStep);
    if (!(step.cwiseAbs().maxCoeff() >= kLastStep)) break;
  }
  return q;
}

template <int J>
double LegSearch<J>::search(const Vec3& target, Angles& q, bool limited) const {
  const Angles free = Angles::Constant(std::numeric_limits<double>::infinity());
  const BoundedLeastSquares<J> problem(limited ? lower_ : Angles(-free), limited ? upper_ : free);
  const auto residuals = [&](const Angles& x, Eigen::Matrix<double, J, J>& jacobian) -> Angles {
    const ChainPose<J> at = chain_.pose(x);
    jacobian = task_ * at.jacobian;
    return task_ * (at.foot - target);
  };
  return problem.minimise(residuals, q);
}

// Moves `q` from a reference to the solution near it, and returns how far the foot stays away from the target.
template <int J>
double LegSearch<J>::solve(const Vec3& target, Angles& q, bool limited) const {
  const Angles found = newton(target, q);
  const bool inside = (found.array() >= lower_.array()).all() && (found.array() <= upper_.array()).all();
  const double distance = missed(target, found).norm();
  if ((inside || !limited) && distance <= tolerance_ && (found - q).cwiseAbs().maxCoeff() < kNear) {
    q = found;
    return distance;
  }
  return search(target, q, limited);
}

// Newton steps to every target begin at the angles of the first one; a target where they miss, or end far from
// the one before, is solved from that one.
template <int J>
FoundAngles LegSearch<J>::follow(const Targets& targets, const Angles& near, bool limited) const {
  FoundAngles out{RowMatrix(targets.rows(), J)};
  Angles begin = near, q = near;
  for (Eigen::Index k = 0; k < targets.rows(); ++k) {
    const Vec3 target = targets.row(k).transpose();
    if (k > 0) {
      const Angles next = newton(target, begin);
      if (missed(target, next).norm() <= tolerance_ && (next - q).cwiseAbs().maxCoeff() < kMostChange) {
        q = next;
        out.q.row(k) = q.transpose();
        continue;
      }
    }
    out.distance = solve(target, q, limited);
    if (!(out.distance <= tolerance_)) {
      out.missed = k;
      return out;
    }
    if (k == 0) {
      begin = q;
      q = newton(target, begin);
    }
    out.q.row(k) = q.transpose();
  }
  return out;
}

template <int J>
FoundAngles LegSearch<J>::each(const Targets& targets, const RowMatrix& near, bool limited) const {
  FoundAngles out{near};
  for (Eigen::Index k = 0; k < targets.rows(); ++k) {
    Angles q = near.row(k).transpose();
    out.distance = solve(targets.row(k).transpose(), q, limited);
    if (!(out.distance <= tolerance_)) {
      out.missed = k;
      return out;
    }
    out.q.row(k) = q.transpose();
  }
  return out;
}

template <int J>
VectorXd LegSearch<J>::distances(const Targets& targets, const Angles& near) const {
  VectorXd out(targets.rows());
  for (Eigen::Index k = 0; k < targets.rows(); ++k) {
    Angles q = near;
    out[k] = search(targets.row(k).transpose(), q, false);
  }
  return out;
}

template class LegSearch<2>;
template class LegSearch<3>;

}  // namespace hexapod
