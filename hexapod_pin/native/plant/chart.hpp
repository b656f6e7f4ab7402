// Local coordinates xi = (r, phi, joints) about a configuration q0 = (p0, R0, joints0):
// p = p0 + R0 r, R = R0 exp(phi^), joints = joints0 + xi_j. The quaternion stays unit by construction.
#pragma once

#include <cmath>

#include <Eigen/Geometry>

#include "laws/vectors.hpp"

namespace hexapod {

inline Eigen::Quaterniond exp_quaternion(const Vec3& phi) {
  const double t2 = phi.squaredNorm();
  if (t2 < 1e-4) {  // one step's turn: the next terms are below 1e-18
    const double sinc = 0.5 - t2 * (1.0 / 48.0 - t2 * (1.0 / 3840.0 - t2 / 645120.0));
    const double cosine = 1.0 - t2 * (1.0 / 8.0 - t2 * (1.0 / 384.0 - t2 / 46080.0));
    return {cosine, sinc * phi.x(), sinc * phi.y(), sinc * phi.z()};
  }
  const double t = std::sqrt(t2);
  const double sinc = std::sin(0.5 * t) / t;
  return {std::cos(0.5 * t), sinc * phi.x(), sinc * phi.y(), sinc * phi.z()};
}

inline void retract(const VectorXd& q0, const VectorXd& xi, VectorXd& q) {
  const Eigen::Quaterniond base(Eigen::Map<const Eigen::Vector4d>(q0.data() + 3));
  q.head<3>() = q0.head<3>() + base * xi.head<3>();
  const Eigen::Quaterniond turned = (base * exp_quaternion(xi.segment<3>(3))).normalized();
  q.segment<4>(3) = turned.coeffs();
  q.tail(q.size() - 7) = q0.tail(q0.size() - 7) + xi.tail(xi.size() - 6);
}

// phi' = Jr^-1(phi) w of a rotation vector phi under the body-frame angular velocity w.
inline Vec3 rotation_vector_rate(const Vec3& phi, const Vec3& w) {
  const double t2 = phi.squaredNorm();
  const double t = std::sqrt(t2);
  const double c = t < 1e-2 ? 1.0 / 12.0 + t2 / 720.0 + t2 * t2 / 30240.0
                            : 1.0 / t2 - (1.0 + std::cos(t)) / (2.0 * t * std::sin(t));
  const Vec3 cross = phi.cross(w);
  return w + (0.5 * cross + c * phi.cross(cross));
}

// xi' from the body-frame velocity v: r' = exp(phi^) v_lin, phi' = Jr^-1(phi) w, joints' = v_j.
inline void chart_rate(const VectorXd& xi, const VectorXd& v, VectorXd& rate) {
  const Vec3 phi = xi.segment<3>(3), w = v.segment<3>(3);
  rate = v;
  rate.head<3>() = exp_quaternion(phi) * v.head<3>();
  rate.segment<3>(3) = rotation_vector_rate(phi, w);
}

// The same map as matrices, frozen at one rotation vector: r' = linear v_lin, phi' = angular w.
struct ChartMap {
  Mat3 linear = Mat3::Identity(), angular = Mat3::Identity(), angular_inverse = Mat3::Identity();

  void capture(const Vec3& phi) {
    for (int k = 0; k < 3; ++k) angular.col(k) = rotation_vector_rate(phi, Vec3::Unit(k));
    linear = exp_quaternion(phi).toRotationMatrix();
    angular_inverse = angular.inverse();
  }
};

}  // namespace hexapod
