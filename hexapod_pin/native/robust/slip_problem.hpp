// Friction of one contact over a step: w + gamma(|w|) G w = u in the eigenbasis of G, for the end
// slip w. The friction impulse is -gamma(|w|) w, gamma = m/s of the slip law.
#pragma once

#include <algorithm>
#include <cmath>

#include "laws/vectors.hpp"
#include "robust/slip_law.hpp"

namespace hexapod {

struct SlipSolution {
  Vec2 impulse = Vec2::Zero();
  Mat2 by_u = Mat2::Zero();       // d impulse/du
  Vec2 by_normal = Vec2::Zero();  // d impulse/d(normal impulse)
};

// `speed`: a guess of |w|, then |w|. `monotone`: take a falling m(s) as level in the derivatives.
class SlipProblem {
 public:
  SlipProblem(const SlipLaw& law, double g1, double g2) : law_(law), g1_(g1), g2_(g2) {}

  SlipSolution solve(const Vec2& u, double normal, double& speed, bool monotone) const {
    if (normal <= 0.0) return {};
    const double size = u.norm();
    if (size < kAtRest) {
      const FrictionResponse at_rest = law_(0.0, normal);
      SlipSolution out;
      out.by_u.diagonal() << -at_rest.ratio / (1.0 + at_rest.ratio * g1_),
          -at_rest.ratio / (1.0 + at_rest.ratio * g2_);
      return out;
    }
    const FrictionResponse found = find(u, size, normal, speed);
    const double slope = monotone ? std::max(found.slope, 0.0) : found.slope;
    return differentiate(u, speed, {found.ratio, slope, found.per_normal});
  }

 private:
  static constexpr int kMaxIterations = 60;
  static constexpr double kAtRest = 1e-14;     // m/s
  static constexpr double kConverged = 1e-5;   // of the slip speed; one Newton step follows

  // Newton on 1/|w/s| - 1, concave and increasing for a concave m(s): monotone from the left. The
  // bracket is for laws that fall.
  FrictionResponse find(const Vec2& u, double size, double normal, double& speed) const {
    double low = std::max(size - g1_ * law_.bound(normal),
                          size / (1.0 + g1_ * law_.largest_ratio(normal)));
    double high = size, s = std::min(std::max(speed, low), high);
    const double u1 = u.x() * u.x(), u2 = u.y() * u.y();
    for (int k = 0; k < kMaxIterations; ++k) {
      const FrictionResponse f = law_(s, normal);
      const double i1 = 1.0 / (s * (1.0 + f.ratio * g1_));
      const double i2 = 1.0 / (s * (1.0 + f.ratio * g2_));
      const double p1 = u1 * i1 * i1, p2 = u2 * i2 * i2, sum = p1 + p2;
      const double fall = p1 * i1 * (1.0 + f.slope * g1_) + p2 * i2 * (1.0 + f.slope * g2_);
      (sum > 1.0 ? low : high) = s;  // w too long: s too small
      double ds = sum * (std::sqrt(sum) - 1.0) / fall;
      if (std::abs(ds) < kConverged * s) {
        speed = s + ds;
        const double m = f.ratio * s + f.slope * ds;
        return {m / speed, f.slope, f.per_normal};
      }
      const double next = s + ds;
      s = next > low && next < high ? next : 0.5 * (low + high);
    }
    speed = s;
    return law_(s, normal);
  }

  SlipSolution differentiate(const Vec2& u, double s, const FrictionResponse& f) const {
    const Vec2 w(u.x() / (1.0 + f.ratio * g1_), u.y() / (1.0 + f.ratio * g2_));
    const Vec2 e = w / s;
    Mat2 t = (f.slope - f.ratio) * e * e.transpose();
    t.diagonal().array() += f.ratio;
    Mat2 a = t * Vec2(g1_, g2_).asDiagonal();
    a.diagonal().array() += 1.0;
    const Mat2 inverse = a.inverse();
    return {-f.ratio * w, -inverse * t, -f.per_normal * (inverse * e)};
  }

  const SlipLaw& law_;
  double g1_, g2_;
};

}  // namespace hexapod
