// Newton iteration on the base with every foot solved exactly inside; falls back to a convex problem.
#pragma once

#include "robust/impulse_problem.hpp"

namespace hexapod {

template <int N>
class NestedNewton {
  using Problem = ImpulseProblem<N>;
  using Matrix = typename Problem::Matrix;
  using Vector = typename Problem::Vector;

 public:
  void solve(Problem& p) {
    p.v.setZero(p.b.size());
    weight_ = p.s.diagonal().cwiseInverse();
    evaluate(p);
    for (int k = 0; k < kMaxIterations; ++k) {
      ++iterations;
      direction(p);
      if (!dv_.allFinite()) break;
      if (p.small(dv_)) return accept(p);
      const Vector from = p.v;
      const double before = merit();
      for (int half = 0; half <= 3; ++half) {
        p.v = from + std::ldexp(1.0, -half) * dv_;
        evaluate(p);
        if (merit() <= 0.99 * before) break;
      }
    }
    finish_convex(p);
  }

  long iterations = 0, convex_finishes = 0;

 private:
  static constexpr int kMaxIterations = 12, kMaxConvexIterations = 60, kMaxBoundUpdates = 10;

  // f = S v - b - sum J^T lambda at p.v
  void evaluate(Problem& p) {
    f_.noalias() = p.s * p.v - p.b;
    for (auto& c : p.contacts) {
      c.foot.solve(c.free + c.jt.transpose() * p.v);
      f_.noalias() -= c.jt * c.foot.impulse;
    }
  }

  double merit() const { return f_.dot(weight_.cwiseProduct(f_)); }

  void direction(const Problem& p) {
    matrix_ = p.s;
    for (const auto& c : p.contacts) {
      if (c.foot.tangent(2, 2) == 0.0 && c.foot.tangent(0, 0) == 0.0) continue;
      const Eigen::Matrix<double, N, 3> scaled = c.jt.lazyProduct(c.foot.tangent);
      matrix_ -= scaled.lazyProduct(c.jt.transpose());
    }
    dv_ = -f_;
    Problem::solve(matrix_, dv_);
  }

  void accept(Problem& p) {
    p.v += dv_;
    for (auto& c : p.contacts)
      c.foot.impulse += c.foot.tangent * (c.jt.transpose() * dv_);
  }

  // Friction bounded by a fixed normal impulse makes the problem the minimum of a convex function; then
  // the bounds are updated. Every pass is dissipative.
  void finish_convex(Problem& p) {
    ++convex_finishes;
    p.v.setZero();
    for (auto& c : p.contacts) c.foot.friction_bound = -1.0;
    evaluate(p);
    for (int k = 0; k < kMaxBoundUpdates; ++k) {
      double change = 0.0, largest = 0.0;
      for (auto& c : p.contacts) {
        const double normal = std::max(c.foot.impulse.z(), 0.0);
        change = std::max(change, std::abs(normal - c.foot.friction_bound));
        largest = std::max(largest, normal);
        c.foot.friction_bound = normal;
      }
      if (change <= 1e-9 * largest) break;
      minimise(p);
    }
  }

  void minimise(Problem& p) {
    evaluate(p);
    for (int k = 0; k < kMaxConvexIterations; ++k) {
      direction(p);
      if (!dv_.allFinite()) break;
      if (p.small(dv_)) return accept(p);
      search_line(p);
    }
    dv_ = -f_;  // not converged: the momentum of the impulses found
    matrix_ = p.s;
    Problem::solve(matrix_, dv_);
    p.v += dv_;
  }

  // Line search along dv to where the function's slope has fallen to a tenth; the slope increases.
  void search_line(Problem& p) {
    const Vector from = p.v;
    const double first = dv_.dot(f_);
    double low = 0.0, high = 1.0, at = 1.0, slope_low = first;
    for (int k = 0; k < 30; ++k) {
      p.v = from + at * dv_;
      evaluate(p);
      const double slope = dv_.dot(f_);
      if (std::abs(slope) <= 0.1 * std::abs(first) || (at == 1.0 && slope <= 0.0)) return;
      (slope < 0.0 ? low : high) = at;
      if (slope < 0.0) slope_low = slope;
      const double secant = slope > 0.0 ? low + (at - low) * slope_low / (slope_low - slope) : 0.0;
      at = secant > low && secant < high && k % 2 == 0 ? secant : 0.5 * (low + high);
    }
  }

  Matrix matrix_;
  Vector f_, dv_, weight_;
};

}  // namespace hexapod
