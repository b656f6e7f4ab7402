// The private problem of one contact: c = a + G lambda(c), where a is its velocity without its own
// impulse and G the compliance of its leg. Axes: two tangents along the eigenvectors of G's tangential
// part, then the normal.
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/LU>

#include "plant/dynamics.hpp"
#include "robust/normal_step.hpp"
#include "robust/slip_problem.hpp"

namespace hexapod {

struct FootProblem {
  NormalStep normal;
  SlipLaw friction;
  Mat3 g = Mat3::Zero();        // G; g(0, 1) = 0
  Vec2 shift = Vec2::Zero();    // of the slip by a stretched bristle, m/s
  double rate = 0.0, slip = 0.0;  // c_n and |w|: guesses, then the solution
  double frozen = -1.0;         // normal impulse that bounds friction; < 0: the contact's own

  Vec3 impulse = Vec3::Zero();
  Mat3 tangent = Mat3::Zero();  // d impulse/da

  // Two nested scalar Newtons: in c_n with a bracket that always holds a root, and in the slip speed.
  void solve(const Vec3& a) {
    bool pressed = std::isfinite(a.z());
    if (frozen >= 0.0) {
      rub(a, 0.0);
      const double x = a.z() + coupling().dot(rubbed_.impulse);
      pressed = normal(x).impulse > 0.0;
    } else {
      pressed = normal(a.z()).impulse > 0.0;
    }
    if (!pressed) return rest(a);
    find_rate(a);
  }

  // The law at end velocity c: its impulse, and d impulse/dc.
  Vec3 law(const Vec3& c, Mat3& slope) const {
    slope.setZero();
    const Push push = normal(c.z());
    if (push.impulse <= 0.0) return Vec3::Zero();
    slope(2, 2) = -push.slope;
    if (friction.none()) return {0.0, 0.0, push.impulse};
    const Vec2 w = c.head<2>() + shift;
    const double s = w.norm();
    const Grip grip = friction(s, push.impulse);
    slope(0, 0) = slope(1, 1) = -grip.gamma;
    if (s > 1e-14) {
      const Vec2 e = w / s;
      slope.topLeftCorner<2, 2>() -= (grip.slope - grip.gamma) * e * e.transpose();
      slope.topRightCorner<2, 1>() = (grip.per_push * push.slope) * e;
    }
    return {-grip.gamma * w.x(), -grip.gamma * w.y(), push.impulse};
  }

 private:
  static constexpr int kMost = 100;

  Vec2 coupling() const { return g.topRightCorner<2, 1>(); }

  void rest(const Vec3& a) {  // no normal impulse; friction only under a frozen bound
    impulse.setZero();
    tangent.setZero();
    if (frozen < 0.0) return;
    impulse.head<2>() = rubbed_.impulse;
    tangent.topLeftCorner<2, 2>() = rubbed_.by_u;
    rate = a.z() + coupling().dot(rubbed_.impulse);
  }

  void rub(const Vec3& a, double push) {
    if (friction.none()) return;
    const SlipProblem problem(friction, g(0, 0), g(1, 1));
    rubbed_ = problem.solve(a.head<2>() + shift + coupling() * push, frozen < 0.0 ? push : frozen,
                            slip, frozen >= 0.0);
    if (frozen >= 0.0) rubbed_.by_push.setZero();
  }

  void find_rate(const Vec3& a) {
    const double gn = g(2, 2), none = -1e300;
    double low = none, high = normal.most(), x = rate;
    if (!(x < high)) x = normal.guess(a.z(), gn);
    for (int k = 0; k < kMost; ++k) {
      const Push push = normal(x);
      rub(a, push.impulse);
      const Vec2 q = rubbed_.by_u * coupling() + rubbed_.by_push;
      const double residual = x - a.z() - gn * push.impulse - coupling().dot(rubbed_.impulse);
      const double steep = 1.0 + push.slope * (gn + coupling().dot(q));
      const double dx = -residual / steep;
      if (steep > 1e-3 && settled(x, dx)) return finish(x, dx, push, q, steep);
      (residual < 0.0 ? low : high) = x;
      const double next = x + dx;
      if (steep > 1e-3 && next > low && next < high) x = next;
      else x = low > none ? 0.5 * (low + high) : x - 2.0 * std::max(high - x, 1e-3);
      if (high - low <= 1e-14 * std::max(std::abs(x), 1e-3))
        return finish(x, 0.0, push, q, std::max(steep, 1e-3));
    }
    const Push push = normal(x);
    rub(a, push.impulse);
    finish(x, 0.0, push, rubbed_.by_u * coupling() + rubbed_.by_push, 1.0);
  }

  bool settled(double x, double dx) const {
    return std::abs(normal.depth_at(x) - normal.depth_at(x + dx)) <= 1e-4 * normal.deepest(x);
  }

  void finish(double x, double dx, const Push& push, const Vec2& q, double steep) {
    rate = x + dx;
    impulse.z() = push.impulse - push.slope * dx;
    impulse.head<2>() = rubbed_.impulse - (push.slope * dx) * q;
    const double b = -push.slope / steep;
    tangent.bottomLeftCorner<1, 2>() = b * (coupling().transpose() * rubbed_.by_u);
    tangent(2, 2) = b;
    tangent.topLeftCorner<2, 2>() = rubbed_.by_u + q * tangent.bottomLeftCorner<1, 2>();
    tangent.topRightCorner<2, 1>() = b * q;
  }

  Slip rubbed_;
};

}  // namespace hexapod
