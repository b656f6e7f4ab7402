// All contacts of a step in one small system: S v = b + sum J^T lambda(c), c = free + J v + G lambda,
// for the velocity change v of the base (and of the joints that are not eliminated).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>

#include "plant/arrow.hpp"
#include "plant/dense.hpp"
#include "robust/foot_problem.hpp"

namespace hexapod {

template <int N>
struct StepContact {
  std::size_t slot = 0;            // in Plant::feet
  FootProblem foot;
  Eigen::Matrix<double, N, 3> jt;  // J^T, the leg eliminated, contact axes
  Mat3 axes;                       // world to contact axes
  Vec3 free, start;                // velocity without impulses at v = 0; before the step, m/s
  Vec3 velocity;                   // at the end, m/s

  // Turns everything from world axes into contact axes: the normal last, the tangents along the
  // eigenvectors of the tangential compliance, the softer first.
  void align(const Vec3& n) {
    axes.row(2) = n;
    const Vec3 t = (std::abs(n.x()) < 0.6 ? Vec3(1.0 - n.x() * n.x(), -n.x() * n.y(), -n.x() * n.z())
                                          : Vec3(-n.y() * n.x(), 1.0 - n.y() * n.y(), -n.y() * n.z()))
                       .normalized();
    const Vec3 side = n.cross(t), gt = foot.g * t;
    const double a = t.dot(gt), b = side.dot(gt), d = 0.5 * (a - side.dot(foot.g * side));
    const double r = std::hypot(d, b);
    double cosine = 1.0, sine = 0.0;
    if (r > 0.0) {
      const double half = std::sqrt(0.5 * (1.0 + std::abs(d) / r)), other = 0.5 * std::abs(b) / (r * half);
      cosine = d >= 0.0 ? half : other;
      sine = std::copysign(d >= 0.0 ? other : half, b);
    }
    axes.row(0) = cosine * t + sine * side;
    axes.row(1) = cosine * side - sine * t;
    jt = (jt.lazyProduct(axes.transpose())).eval();
    foot.g = axes.lazyProduct(foot.g.lazyProduct(axes.transpose()).eval()).eval();
    foot.g(0, 1) = foot.g(1, 0) = 0.0;
    start = (axes * start).eval();
    free = (axes * free).eval();
  }
};

template <int N>
struct ImpulseProblem {
  using Matrix = Eigen::Matrix<double, N, N>;
  using Vector = Eigen::Matrix<double, N, 1>;

  Matrix s;
  Vector b, v;
  std::vector<StepContact<N>> contacts;
  bool rigid = false;   // a contact has no compliance of its own leg
  double length = 0.0;  // the body's radius of gyration about its frame, m

  // Solves m x = x in place; the matrix is overwritten.
  static void solve(Matrix& m, Vector& x) {
    if constexpr (N == 6) {
      factor_lu(m);
      solve_lu(m, x);
    } else {
      solve_dense(m, x);
    }
  }

  // Speed of a fall from the body's size, m/s: the scale of changes of velocity.
  double speed() const { return std::sqrt(kGravity * length); }

  // Change of v below which the solve has converged, m/s. Without leg compliance the linear update of the
  // impulses must be as accurate as the law.
  double tolerance() const { return rigid ? 1e-11 : std::max(1e-11, kConverged * speed()); }

  bool small(const Vector& dv) const {
    const double linear = dv.template head<3>().cwiseAbs().maxCoeff();
    const double turning = dv.tail(dv.size() - 3).cwiseAbs().maxCoeff();
    return linear + length * turning < tolerance();
  }

  // End velocities of the contacts.
  void find_velocities() {
    for (auto& c : contacts) c.velocity = c.free + c.jt.transpose() * v + c.foot.g * c.foot.impulse;
  }

 private:
  static constexpr double kGravity = 9.81;    // m/s^2, the Earth's, wherever the robot walks
  static constexpr double kConverged = 1e-4;  // of that speed
};

}  // namespace hexapod
