// Forces of the feet that hold a robot in balance: along the vertical, or with the least torque of the
// joints within the friction cone of every foot.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "control/stance_forces.hpp"
#include "control/walk_table.hpp"
#include "laws/vectors.hpp"
#include "plant/small_lu.hpp"

namespace hexapod {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Mat63 = Eigen::Matrix<double, 6, 3>;

// A leg at rest, trunk axes: torque = own - jacobian^T force.
struct LegStatics {
  Mat3 jacobian;  // of the contact point, m/rad
  Vec3 arm;       // of the contact point from the robot's centre of mass, m
  Vec3 own;       // torques that hold the leg's own weight, N m
};

using LegsStatics = std::array<LegStatics, kLegs>;

struct LeastTorque {
  std::array<Vec3, kLegs> cost = {};  // of the square of each joint's torque, 1/(N m)^2
  double damping = 0.0;               // of the forces, over the mean cost of a force, -
  double friction = 0.0;              // largest tangential force over normal force, -
};

// Feet with smaller weights limit the others' forces less, in proportion.
constexpr double kSmallShare = 0.2;

// x of (a + damping) x = b for a positive definite a, then improved against a: exact where a is far from
// singular, bounded elsewhere.
template <int N>
Eigen::Matrix<double, N, 1> solved_damped(const Eigen::Matrix<double, N, N>& a, double damping,
                                          const Eigen::Matrix<double, N, 1>& b) {
  constexpr int kRefinements = 4;
  Eigen::Matrix<double, N, N> factors = a;
  factors.diagonal().array() += damping;
  factor_lu(factors);
  Eigen::Matrix<double, N, 1> x = b;
  solve_lu(factors, x);
  for (int k = 0; k < kRefinements; ++k) {
    Eigen::Matrix<double, N, 1> rest = b - a * x;
    solve_lu(factors, rest);
    x += rest;
  }
  return x;
}

// Forces along `up` that balance a weight [N] at the centre of mass; of all such sets that of least
// sum f^2 / weight. Feet of weight 0 have none.
inline LegVectors vertical_forces(const LegsStatics& legs, const LegNumbers& weight, double load, const Vec3& up) {
  const Vec3 ahead = Vec3::UnitY().cross(up).normalized(), aside = up.cross(ahead);
  std::array<Vec3, kLegs> row;
  Mat3 balance = Mat3::Zero();
  LegVectors force;
  force.fill(Vec3::Zero());
  for (int l = 0; l < kLegs; ++l) {
    row[l] = Vec3(1.0, legs[l].arm.dot(ahead), legs[l].arm.dot(aside));
    balance += weight[l] * row[l] * row[l].transpose();
  }
  if (!(balance(0, 0) > 0.0)) return force;
  constexpr double kLine = 1e-5;  // m^2: feet nearer to one line than 3 mm do not fix the split
  const Vec3 pressure = solved_damped(balance, kLine * balance(0, 0), Vec3(load * Vec3::UnitX()));
  for (int l = 0; l < kLegs; ++l) force[l] = weight[l] * row[l].dot(pressure) * up;
  return force;
}

// Forces that balance a load [N] with the least sum of cost torque^2 / weight: f_i = w_i H_i^-1 (J_i R g_i +
// A_i^T l), with H = J R J^T + damping, A the wrench of a force about the centre of mass, and l from balance:
// one system of six equations for any number of feet.
inline LegVectors least_torque_forces(const LeastTorque& set, const LegsStatics& legs, const LegNumbers& weight,
                                      const Vec3& load) {
  constexpr double kRegular = 1e-9;  // damping of the system, over its trace
  std::array<Mat3, kLegs> cost;
  LegVectors own, force;
  double mean = 0.0, reach = 0.0, all = 0.0;
  for (int l = 0; l < kLegs; ++l) {
    const Mat3 costly = legs[l].jacobian * set.cost[l].asDiagonal();
    cost[l] = costly * legs[l].jacobian.transpose();
    own[l] = costly * legs[l].own;
    mean += cost[l].trace() / (3.0 * kLegs);
    reach += weight[l] * legs[l].arm.squaredNorm(), all += weight[l];
    force[l].setZero();
  }
  if (!(all > 0.0)) return force;
  const double length = std::sqrt(reach / all);  // moments over it are forces
  Mat6 system = Mat6::Zero();
  Vec6 wanted = Vec6::Zero();
  wanted.head<3>() = load;
  std::array<Mat3, kLegs> yield;
  std::array<Mat63, kLegs> wrench;
  for (int l = 0; l < kLegs; ++l) {
    cost[l].diagonal().array() += set.damping * mean;
    yield[l] = weight[l] * cost[l].inverse();
    const Vec3 r = legs[l].arm / length;
    wrench[l].topRows<3>().setIdentity();
    wrench[l].bottomRows<3>() << 0.0, -r.z(), r.y(), r.z(), 0.0, -r.x(), -r.y(), r.x(), 0.0;
    const Mat63 share = wrench[l] * yield[l];
    system += share * wrench[l].transpose();
    wanted -= share * own[l];
  }
  const Vec6 price = solved_damped(system, kRegular * system.trace(), wanted);
  for (int l = 0; l < kLegs; ++l) force[l] = yield[l] * (own[l] + wrench[l].transpose() * price);
  return force;
}

// How far a force may go from `from` to `to` and stay in a cone about `normal`, 0 to 1.
inline double share_in_cone(const Vec3& from, const Vec3& to, const Vec3& normal, double friction) {
  const double c = from.dot(normal), d = to.dot(normal) - c;
  const Vec3 a = from - c * normal, b = to - from - d * normal;
  const double mu2 = friction * friction;
  if (c + d >= 0.0 && (a + b).norm() <= friction * (c + d)) return 1.0;
  const double inside = a.squaredNorm() - mu2 * c * c;
  if (c <= 0.0 || inside >= 0.0) return 0.0;
  const double half = a.dot(b) - mu2 * c * d, square = b.squaredNorm() - mu2 * d * d;
  const double root = half + std::sqrt(std::max(0.0, half * half - square * inside));
  return root > 0.0 ? std::clamp(-inside / root, 0.0, 1.0) : 1.0;
}

// Of the forces between the vertical ones and those of least torque the nearest to the latter at which no
// foot leaves its cone about `normal`. All of them balance the weight; they are continuous in the weights.
inline LegVectors force_targets(const LeastTorque& set, const LegsStatics& legs, const LegNumbers& weight,
                                double load, const Vec3& up, const Vec3& normal) {
  const LegVectors upright = vertical_forces(legs, weight, load, up);
  const LegVectors least = least_torque_forces(set, legs, weight, load * up);
  LegNumbers sorted = weight;
  std::nth_element(sorted.begin(), sorted.begin() + 2, sorted.end(), std::greater<double>());
  double share = std::min(1.0, sorted[2] / kSmallShare);  // two feet cannot balance moments
  for (int l = 0; l < kLegs; ++l) {
    const double own = share_in_cone(upright[l], least[l], normal, set.friction);
    share = std::min(share, 1.0 - std::min(1.0, weight[l] / kSmallShare) * (1.0 - own));
  }
  LegVectors force;
  for (int l = 0; l < kLegs; ++l) force[l] = upright[l] + share * (least[l] - upright[l]);
  return force;
}

}  // namespace hexapod
