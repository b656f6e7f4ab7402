// The private problem of one contact: c = a + G lambda(c), where a is its velocity without its own
// impulse and G the compliance of its leg. Axes: two tangents along the eigenvectors of G's tangential
// part, then the normal.
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "laws/vectors.hpp"
#include "robust/normal_step.hpp"
#include "robust/slip_problem.hpp"

namespace hexapod {

struct FootProblem {
  NormalStep normal;
  SlipLaw friction;
  Mat3 g = Mat3::Zero();          // G; g(0, 1) = 0
  Vec2 shift = Vec2::Zero();      // of the slip by a stretched bristle, m/s
  double rate = 0.0, slip = 0.0;  // c_n and |w|: guesses, then the solution
  double friction_bound = -1.0;   // fixed normal impulse that bounds friction; < 0: the contact's own

  Vec3 impulse = Vec3::Zero();
  Mat3 tangent = Mat3::Zero();  // d impulse/da

  // Two nested scalar Newtons: in c_n with a bracket that always holds a root, and in the slip speed.
  void solve(const Vec3& a) {
    bool pressed = std::isfinite(a.z());
    if (friction_bound >= 0.0) {
      solve_friction(a, 0.0);
      const double x = a.z() + coupling().dot(friction_.impulse);
      pressed = normal(x).impulse > 0.0;
    } else {
      pressed = normal(a.z()).impulse > 0.0;
    }
    if (!pressed) return finish_unpressed(a);
    find_rate(a);
  }

  // The law at end velocity c: its impulse, and d impulse/dc.
  Vec3 law(const Vec3& c, Mat3& slope) const {
    slope.setZero();
    const NormalImpulse n = normal(c.z());
    if (n.impulse <= 0.0) return Vec3::Zero();
    slope(2, 2) = -n.slope;
    if (friction.none()) return {0.0, 0.0, n.impulse};
    const Vec2 w = c.head<2>() + shift;
    const double s = w.norm();
    const FrictionResponse f = friction(s, n.impulse);
    slope(0, 0) = slope(1, 1) = -f.ratio;
    if (s > kAtRest) {
      const Vec2 e = w / s;
      slope.topLeftCorner<2, 2>() -= (f.slope - f.ratio) * e * e.transpose();
      slope.topRightCorner<2, 1>() = (f.per_normal * n.slope) * e;
    }
    return {-f.ratio * w.x(), -f.ratio * w.y(), n.impulse};
  }

 private:
  static constexpr int kMaxIterations = 100;
  static constexpr double kAtRest = 1e-14;           // m/s, of the slip
  static constexpr double kLeastSpeed = 1e-3;        // m/s, in relative bounds on c_n
  static constexpr double kLeastSteepness = 1e-3;    // -, of the residual, for a Newton step
  static constexpr double kDepthTolerance = 1e-4;    // of the depth, by the last Newton step

  Vec2 coupling() const { return g.topRightCorner<2, 1>(); }

  void finish_unpressed(const Vec3& a) {  // no normal impulse; friction only under a fixed bound
    impulse.setZero();
    tangent.setZero();
    if (friction_bound < 0.0) return;
    impulse.head<2>() = friction_.impulse;
    tangent.topLeftCorner<2, 2>() = friction_.by_u;
    rate = a.z() + coupling().dot(friction_.impulse);
  }

  void solve_friction(const Vec3& a, double normal_impulse) {
    if (friction.none()) return;
    const bool fixed = friction_bound >= 0.0;
    const SlipProblem problem(friction, g(0, 0), g(1, 1));
    friction_ = problem.solve(a.head<2>() + shift + coupling() * normal_impulse,
                              fixed ? friction_bound : normal_impulse, slip, fixed);
    if (fixed) friction_.by_normal.setZero();
  }

  // d(tangential impulse)/d(normal impulse), through the coupling too
  Vec2 by_normal() const { return friction_.by_u * coupling() + friction_.by_normal; }

  void find_rate(const Vec3& a) {
    const double gn = g(2, 2), none = -1e300;
    double low = none, high = normal.separation_velocity(), x = rate;
    if (!(x < high)) x = normal.guess(a.z(), gn);
    for (int k = 0; k < kMaxIterations; ++k) {
      const NormalImpulse n = normal(x);
      solve_friction(a, n.impulse);
      const Vec2 q = by_normal();
      const double residual = x - a.z() - gn * n.impulse - coupling().dot(friction_.impulse);
      const double steepness = 1.0 + n.slope * (gn + coupling().dot(q));
      const double dx = -residual / steepness;
      if (steepness > kLeastSteepness && converged(x, dx)) return finish(x, dx, n, q, steepness);
      (residual < 0.0 ? low : high) = x;
      const double next = x + dx;
      if (steepness > kLeastSteepness && next > low && next < high) x = next;
      else x = low > none ? 0.5 * (low + high) : x - 2.0 * std::max(high - x, kLeastSpeed);
      if (high - low <= 1e-14 * std::max(std::abs(x), kLeastSpeed))
        return finish(x, 0.0, n, q, std::max(steepness, kLeastSteepness));
    }
    const NormalImpulse n = normal(x);
    solve_friction(a, n.impulse);
    finish(x, 0.0, n, by_normal(), 1.0);
  }

  bool converged(double x, double dx) const {
    const double change = std::abs(normal.depth_at(x) - normal.depth_at(x + dx));
    return change <= kDepthTolerance * normal.deepest(x);
  }

  void finish(double x, double dx, const NormalImpulse& n, const Vec2& q, double steepness) {
    rate = x + dx;
    impulse.z() = n.impulse - n.slope * dx;
    impulse.head<2>() = friction_.impulse - (n.slope * dx) * q;
    const double b = -n.slope / steepness;
    tangent.bottomLeftCorner<1, 2>() = b * (coupling().transpose() * friction_.by_u);
    tangent(2, 2) = b;
    tangent.topLeftCorner<2, 2>() = friction_.by_u + q * tangent.bottomLeftCorner<1, 2>();
    tangent.topRightCorner<2, 1>() = b * q;
  }

  SlipSolution friction_;
};

}  // namespace hexapod
