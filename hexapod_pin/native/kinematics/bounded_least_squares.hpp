// Least squares of N residuals of N variables within bounds, by reflections from the bounds within a trust
// region: Branch, Coleman, Li, SIAM J. Sci. Comput. 21 (1999) 1-23. The steps are those of SciPy's
// `least_squares(method="trf")`, whose trust-region problem is solved as More did (1977), by one
// singular-value decomposition. Some tens of steps find a solution from anywhere, or the nearest there is.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace hexapod {

template <int N>
class BoundedLeastSquares {
 public:
  using Vector = Eigen::Matrix<double, N, 1>;
  using Matrix = Eigen::Matrix<double, N, N>;

  static constexpr double kTolerance = 1e-15;      // of cost, variables and gradient
  static constexpr int kMostEvaluations = 100 * N;

  BoundedLeastSquares(const Vector& lower, const Vector& upper) : lower_(lower), upper_(upper) {}

  // Moves `x` to a local minimum and returns the norm of the residuals there.
  // `residuals(x, jacobian)` returns them and writes their derivatives.
  template <class Residuals>
  double minimise(Residuals&& residuals, Vector& x) const {
    x = interior(x.cwiseMax(lower_).cwiseMin(upper_), kFirstMargin);
    Problem now;
    now.f = residuals(x, now.jacobian);
    double cost = 0.5 * now.f.squaredNorm();
    scale(now, x);
    double radius = (x.array() / now.d.array()).matrix().norm(), damping = 0.0;
    if (radius == 0.0) radius = 1.0;
    bool ended = false;
    for (int count = 1; count < kMostEvaluations && !ended;) {
      const double slope = (now.gradient.array() * now.d.array().square()).abs().maxCoeff();
      if (!(slope >= kTolerance)) break;
      const Region region(now);
      const double back = std::max(0.995, 1.0 - slope);
      Problem next;
      Vector moved;
      double gain = -1.0;
      while (gain <= 0.0 && count < kMostEvaluations && !ended) {
        const Step step = chosen(now, x, region.step(radius, damping), radius, back);
        moved = interior(x + step.p, 0.0);
        next.f = residuals(moved, next.jacobian);
        ++count;
        gain = cost - 0.5 * next.f.squaredNorm();
        const double ratio = step.gain > 0.0 ? gain / step.gain : step.gain == 0.0 && gain == 0.0;
        const double length = step.hat.norm();
        ended = (gain < kTolerance * cost && ratio > 0.25) ||
                step.p.norm() < kTolerance * (kTolerance + x.norm());
        const double before = radius;
        if (ratio < 0.25) radius = 0.25 * length;
        else if (ratio > 0.75 && length > 0.95 * radius) radius *= 2.0;
        damping *= before / radius;
      }
      if (!(gain > 0.0)) break;
      x = moved;
      now = next;
      cost = 0.5 * now.f.squaredNorm();
      scale(now, x);
    }
    return now.f.norm();
  }

 private:
  static constexpr double kFirstMargin = 1e-10;  // of the first point from the bounds, relative
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  // The residuals at a point, and its variables scaled by their distances from the bounds that the
  // gradient leads to ("hat").
  struct Problem {
    Vector f, gradient;
    Matrix jacobian, hat_jacobian;
    Vector d, curvature, hat_gradient;  // scale; curvature that the scaling adds
  };

  struct Step {
    Vector p, hat;
    double gain;  // of the cost, as the quadratic model predicts it
  };

  void scale(Problem& at, const Vector& x) const {
    at.gradient = at.jacobian.transpose() * at.f;
    at.d.setOnes();
    at.curvature.setZero();
    for (int k = 0; k < N; ++k) {
      const double slope = at.gradient[k], distance = slope < 0.0 ? upper_[k] - x[k] : x[k] - lower_[k];
      if (slope == 0.0 || !std::isfinite(distance)) continue;
      at.d[k] = std::sqrt(distance);
      at.curvature[k] = std::abs(slope);
    }
    at.hat_gradient = at.d.cwiseProduct(at.gradient);
    at.hat_jacobian = at.jacobian * at.d.asDiagonal();
  }

  // Steps that minimise the quadratic model within a radius, from the singular values s and the right singular
  // vectors of the Jacobian with the root of the curvature below it.
  class Region {
   public:
    explicit Region(const Problem& at) {
      Stacked a;
      a.template topRows<N>() = at.hat_jacobian;
      a.template bottomRows<N>() = at.curvature.cwiseSqrt().asDiagonal();
      make_orthogonal(a);
      square_ = a.colwise().squaredNorm();
      suf_ = a.template topRows<N>().transpose() * at.f;
      const double rounding = std::numeric_limits<double>::epsilon() * N;
      full_ = square_.minCoeff() > rounding * rounding * square_.maxCoeff();
    }

    // `damping` is where the search for the damping begins, and what it has found.
    Vector step(double radius, double& damping) const {
      if (full_) {
        const Vector newton = damped(0.0);
        if (newton.norm() <= radius) {
          damping = 0.0;
          return newton;
        }
      }
      double upper = suf_.norm() / radius, lower = 0.0;
      const auto between = [&] { return std::max(0.001 * upper, std::sqrt(lower * upper)); };
      if (full_) {
        const auto [excess, slope] = excess_at(0.0, radius);
        lower = -excess / slope;
      } else if (damping == 0.0) {
        damping = between();
      }
      for (int tries = 0; tries < kMostTries; ++tries) {
        if (damping < lower || damping > upper) damping = between();
        const auto [excess, slope] = excess_at(damping, radius);
        if (excess < 0.0) upper = damping;
        lower = std::max(lower, damping - excess / slope);
        damping -= (excess + radius) * (excess / slope) / radius;
        if (std::abs(excess) < kNearRadius * radius) break;
      }
      const Vector p = damped(damping);
      return p * (radius / p.norm());
    }

   private:
    using Stacked = Eigen::Matrix<double, 2 * N, N>;
    static constexpr int kMostTries = 10, kMostSweeps = 30;
    static constexpr double kNearRadius = 0.01;  // a step within this share of the radius is as long as it

    // Rotates pairs of columns until all are perpendicular (one-sided Jacobi), and keeps the rotations.
    void make_orthogonal(Stacked& a) {
      v_.setIdentity();
      bool turned = true;
      for (int sweep = 0; turned && sweep < kMostSweeps; ++sweep) {
        turned = false;
        for (int i = 0; i < N - 1; ++i)
          for (int j = i + 1; j < N; ++j) {
            const double one = a.col(i).squaredNorm(), other = a.col(j).squaredNorm();
            const double both = a.col(i).dot(a.col(j));
            if (!(std::abs(both) > std::numeric_limits<double>::epsilon() * std::sqrt(one * other))) continue;
            turned = true;
            const double twice = (other - one) / (2.0 * both);
            const double t = std::copysign(1.0, twice) / (std::abs(twice) + std::hypot(1.0, twice));
            const double c = 1.0 / std::hypot(1.0, t);
            turn(a, i, j, c, c * t);
            turn(v_, i, j, c, c * t);
          }
      }
    }

    template <class Columns>
    static void turn(Columns& a, int i, int j, double c, double s) {
      const auto before = a.col(i).eval();
      a.col(i) = c * before - s * a.col(j);
      a.col(j) = s * before + c * a.col(j);
    }

    Vector damped(double damping) const {
      return -(v_ * (suf_.array() / (square_.array() + damping)).matrix());
    }

    // By how much a damped step is longer than the radius, and the derivative by the damping.
    std::pair<double, double> excess_at(double damping, double radius) const {
      const Vector denominator = square_.array() + damping;
      const double length = suf_.cwiseQuotient(denominator).norm();
      const double slope = (suf_.array().square() / denominator.array().cube()).sum() / length;
      return {length - radius, -slope};
    }

    Vector square_, suf_;  // s^2; s times the residuals along the left singular vectors
    Matrix v_;
    bool full_;            // no singular value is rounding
  };

  // The best of three steps that stay inside: the one of the trust region cut at the bound, the same
  // reflected there, and the one of steepest descent.
  Step chosen(const Problem& at, const Vector& x, Vector hat, double radius, double back) const {
    const Vector& d = at.d;
    Vector p = d.cwiseProduct(hat);
    if (inside(x + p)) return {p, hat, -model(at, hat)};
    const auto [stride, hit] = to_bound(x, p);
    Vector mirrored = hat;
    for (int k = 0; k < N; ++k)
      if (hit[k]) mirrored[k] = -mirrored[k];
    Vector r = d.cwiseProduct(mirrored);
    p *= stride;
    hat *= stride;
    const double region = to_region(hat, mirrored, radius), bound = to_bound(x + p, r).first;
    const double longest = std::min(bound, region);
    double first = 0.0, last = -1.0, r_value = kInfinity;
    if (longest > 0.0) {
      first = (1.0 - back) * stride / longest;
      last = longest == bound ? back * bound : region;
    }
    if (first <= last) {
      const auto [length, value] = lowest(at, mirrored, hat, first, last);
      mirrored = mirrored * length + hat;
      r = mirrored.cwiseProduct(d);
      r_value = value;
    }
    p *= back;
    hat *= back;
    const double p_value = model(at, hat);
    Vector down = -at.hat_gradient, descent = d.cwiseProduct(down);
    const double edge = radius / down.norm(), wall = to_bound(x, descent).first;
    const auto [length, value] = lowest(at, down, Vector::Zero(), 0.0, wall < edge ? back * wall : edge);
    if (p_value < r_value && p_value < value) return {p, hat, -p_value};
    if (r_value < p_value && r_value < value) return {r, mirrored, -r_value};
    return {descent * length, down * length, -value};
  }

  // Change of the cost by a step, as the quadratic model predicts it.
  static double model(const Problem& at, const Vector& hat) {
    return 0.5 * ((at.hat_jacobian * hat).squaredNorm() + hat.dot(at.curvature.cwiseProduct(hat))) +
           at.hat_gradient.dot(hat);
  }

  // The length along `line` from `start`, between two, at which the model is lowest, and its value.
  static std::pair<double, double> lowest(const Problem& at, const Vector& line, const Vector& start,
                                          double first, double last) {
    const Vector v = at.hat_jacobian * line, u = at.hat_jacobian * start;
    const double a = 0.5 * (v.squaredNorm() + line.dot(at.curvature.cwiseProduct(line)));
    const double b = at.hat_gradient.dot(line) + u.dot(v) + start.dot(at.curvature.cwiseProduct(line));
    const double c = model(at, start);
    const auto value = [&](double t) { return t * (a * t + b) + c; };
    double best = value(last) < value(first) ? last : first;
    const double middle = -0.5 * b / a;
    if (a != 0.0 && first < middle && middle < last && value(middle) < value(best)) best = middle;
    return {best, value(best)};
  }

  // The length along `line` from `start` at which a step reaches the radius.
  static double to_region(const Vector& start, const Vector& line, double radius) {
    const double a = line.squaredNorm(), b = start.dot(line);
    const double c = std::min(start.squaredNorm() - radius * radius, 0.0);
    const double q = -(b + std::copysign(std::sqrt(b * b - a * c), b));
    return std::max(q / a, c / q);
  }

  // The length along `line` from `x` to the first bound, and which variables are at theirs then.
  std::pair<double, std::array<bool, N>> to_bound(const Vector& x, const Vector& line) const {
    std::array<double, N> length;
    for (int k = 0; k < N; ++k)
      length[k] = line[k] == 0.0 ? kInfinity
                                 : std::max((lower_[k] - x[k]) / line[k], (upper_[k] - x[k]) / line[k]);
    const double least = *std::min_element(length.begin(), length.end());
    std::array<bool, N> hit;
    for (int k = 0; k < N; ++k) hit[k] = length[k] == least && line[k] != 0.0;
    return {least, hit};
  }

  bool inside(const Vector& x) const {
    return (x.array() >= lower_.array()).all() && (x.array() <= upper_.array()).all();
  }

  // `x` moved off the bounds by a relative margin, or to the next number.
  Vector interior(Vector x, double margin) const {
    for (int k = 0; k < N; ++k) {
      const double below = x[k] - lower_[k], above = upper_[k] - x[k];
      const double low = margin * std::max(1.0, std::abs(lower_[k]));
      const double high = margin * std::max(1.0, std::abs(upper_[k]));
      if (std::isfinite(lower_[k]) && below <= std::min(above, low))
        x[k] = margin > 0.0 ? lower_[k] + low : std::nextafter(lower_[k], upper_[k]);
      else if (std::isfinite(upper_[k]) && above <= std::min(below, high))
        x[k] = margin > 0.0 ? upper_[k] - high : std::nextafter(upper_[k], lower_[k]);
      if (x[k] < lower_[k] || x[k] > upper_[k]) x[k] = 0.5 * (lower_[k] + upper_[k]);
    }
    return x;
  }

  Vector lower_, upper_;
};

}  // namespace hexapod
