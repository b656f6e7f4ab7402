// A cheap first attempt: every law linearised at its contact's velocity, one solve per sweep. It finds
// the solution of the nested Newton or fails.
#pragma once

#include "robust/impulse_problem.hpp"

namespace hexapod {

template <int N>
class FlatNewton {
  using Problem = ImpulseProblem<N>;

 public:
  bool solve(Problem& p) {
    points_.resize(p.contacts.size());
    for (std::size_t i = 0; i < points_.size(); ++i) points_[i].c = p.contacts[i].start;
    for (int k = 0; k < kMaxSweeps; ++k) {
      ++sweeps;
      if (!sweep(p)) return false;
      bool done = p.v.allFinite();
      for (std::size_t i = 0; i < points_.size(); ++i) done &= move(p.contacts[i], points_[i], p);
      if (done) return ++hits, true;
    }
    return false;
  }

  long sweeps = 0, hits = 0;

 private:
  static constexpr int kMaxSweeps = 6;

  struct Point {
    Vec3 c, constant;  // lambda = constant + lam J v
    Mat3 lam;
    bool pressed;  // has a normal impulse
  };

  bool sweep(Problem& p) {
    matrix_ = p.s;
    p.v = p.b;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const auto& contact = p.contacts[i];
      Point& point = points_[i];
      Mat3 slope;
      const Vec3 impulse = contact.foot.law(point.c, slope);
      point.pressed = impulse.z() > 0.0;
      if (!point.pressed) continue;
      const Mat3 a = Mat3::Identity() - contact.foot.g.lazyProduct(slope);
      Mat3 inverse;
      bool invertible = false;
      a.computeInverseWithCheck(inverse, invertible, 1e-9);
      if (!invertible) return false;
      const Vec3 offset = impulse - slope * point.c;
      point.lam.noalias() = slope.lazyProduct(inverse);
      point.constant = offset + point.lam * (contact.foot.g * offset + contact.free);
      const Eigen::Matrix<double, N, 3> scaled = contact.jt.lazyProduct(point.lam);
      matrix_ -= scaled.lazyProduct(contact.jt.transpose());
      p.v.noalias() += contact.jt * point.constant;
    }
    Problem::solve(matrix_, p.v);
    return true;
  }

  // Moves a contact's point of linearisation; true if the linear law there is as accurate as the law.
  bool move(StepContact<N>& contact, Point& point, const Problem& p) const {
    FootProblem& foot = contact.foot;
    const Vec3 there = contact.jt.transpose() * p.v;
    foot.impulse.setZero();
    if (point.pressed) foot.impulse = point.constant + point.lam * there;
    const Vec3 end = contact.free + there + foot.g * foot.impulse, dc = end - point.c;
    if (!point.pressed) {
      point.c = end;
      return foot.normal(end.z()).impulse == 0.0;
    }
    const double width = foot.friction.none() ? 1e300 : foot.friction.width(foot.impulse.z());
    const double depth = foot.normal.deepest(point.c.z());
    const double change = foot.normal.depth_at(end.z()) - foot.normal.depth_at(point.c.z());
    const double tolerance = kVelocityTolerance * p.speed();  // m/s
    const bool converged = foot.impulse.z() >= 0.0 && std::abs(dc.z()) < tolerance &&
                      std::abs(change) <= kDepthTolerance * depth &&
                      dc.head<2>().norm() < std::min(tolerance, 0.01 * width);
    point.c += limit(point.c.template head<2>() + foot.shift, dc.head<2>(), width) * dc;
    return converged;
  }

  // A slip that would reverse stops where it comes nearest to zero, because the tangent at one sliding
  // direction says nothing of the opposite one (TAMSI: Castro et al. 2020).
  static double limit(const Vec2& w, const Vec2& dw, double width) {
    const double length = dw.squaredNorm();
    if (!(length > width * width)) return 1.0;
    const double at = -w.dot(dw) / length;
    if (at <= 0.0 || at >= 1.0 || w.norm() <= width) return 1.0;
    return (w + at * dw).norm() < width ? at : 1.0;
  }

  static constexpr double kVelocityTolerance = 1e-5;  // of the problem's speed
  static constexpr double kDepthTolerance = 1e-3;     // of the depth
  typename Problem::Matrix matrix_;
  std::vector<Point> points_;
};

}  // namespace hexapod
