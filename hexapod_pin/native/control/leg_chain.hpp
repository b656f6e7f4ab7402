// A leg of three revolute joints seen from the trunk: where its foot is, and what its own motion costs.
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "laws/vectors.hpp"

namespace hexapod {

// A link at joint angles of zero, base axes.
struct LegLink {
  Vec3 axis, origin;         // of the joint that carries it: unit vector; m
  double mass;               // kg
  Vec3 centre;               // of mass, m
  Mat3 inertia;              // about the centre of mass, kg m^2
  double armature, damping;  // of the joint, kg m^2, N m s/rad
  double dry_friction;       // of the joint, N m
};

// The motion of the trunk as its sensors have it, trunk axes.
struct TrunkMotion {
  Vec3 rate;          // rad/s
  Vec3 acceleration;  // of its origin less gravity, m/s^2
};

struct LegPose {
  Vec3 foot;                                // m
  Mat3 jacobian;                            // d foot / d q, a column per joint, m/rad
  std::array<Vec3, 3> axis, origin, centre;  // base axes
  std::array<Mat3, 3> rotation;             // of the links since q = 0
};

class LegChain {
 public:
  LegChain(const std::array<LegLink, 3>& links, const Vec3& foot) : links_(links), foot_(foot) {}

  LegPose pose(const Vec3& q) const {
    LegPose out;
    Mat3 turn = Mat3::Identity();
    Vec3 shift = Vec3::Zero();
    for (int k = 0; k < 3; ++k) {
      const LegLink& link = links_[k];
      out.axis[k] = turn * link.axis;
      out.origin[k] = turn * link.origin + shift;
      turn = turn * Eigen::AngleAxisd(q[k], link.axis).toRotationMatrix();
      shift = out.origin[k] - turn * link.origin;
      out.rotation[k] = turn;
      out.centre[k] = turn * link.centre + shift;
    }
    out.foot = turn * foot_ + shift;
    for (int k = 0; k < 3; ++k) out.jacobian.col(k) = out.axis[k].cross(out.foot - out.origin[k]);
    return out;
  }

  // Sum of mass times centre of its links, kg m.
  Vec3 mass_moment(const LegPose& at) const {
    Vec3 moment = Vec3::Zero();
    for (int k = 0; k < 3; ++k) moment += links_[k].mass * at.centre[k];
    return moment;
  }

  // Torques that the leg needs for its own weight and motion, its foot free (Newton-Euler), N m. The
  // trunk's angular acceleration is left out: no sensor gives it.
  Vec3 own_torque(const LegPose& at, const TrunkMotion& trunk, const Vec3& v, const Vec3& a) const {
    std::array<Vec3, 3> force, moment;
    Vec3 spin = trunk.rate, spin_rate = Vec3::Zero(), origin = Vec3::Zero();
    Vec3 acceleration = trunk.acceleration;
    for (int k = 0; k < 3; ++k) {
      acceleration += at_point(spin, spin_rate, at.origin[k] - origin);
      origin = at.origin[k];
      spin_rate += at.axis[k] * a[k] + spin.cross(at.axis[k] * v[k]);
      spin += at.axis[k] * v[k];
      const Mat3 inertia = at.rotation[k] * links_[k].inertia * at.rotation[k].transpose();
      force[k] = links_[k].mass * (acceleration + at_point(spin, spin_rate, at.centre[k] - origin));
      moment[k] = inertia * spin_rate + spin.cross(inertia * spin);
    }
    Vec3 torque, above = Vec3::Zero(), turning = Vec3::Zero();
    for (int k = 2; k >= 0; --k) {  // `turning`: moment of what is outside joint k, about its origin
      if (k < 2) turning += (at.origin[k + 1] - at.origin[k]).cross(above);
      turning += moment[k] + (at.centre[k] - at.origin[k]).cross(force[k]);
      above += force[k];
      torque[k] = at.axis[k].dot(turning) + links_[k].armature * a[k];
    }
    return torque;
  }

  // What friction takes from the motors' torques, N m.
  Vec3 friction(const Vec3& v) const {
    Vec3 torque;
    for (int k = 0; k < 3; ++k) {
      const double sign = v[k] > 0.0 ? 1.0 : v[k] < 0.0 ? -1.0 : 0.0;
      torque[k] = links_[k].damping * v[k] + links_[k].dry_friction * sign;
    }
    return torque;
  }

 private:
  // Acceleration of a point of a turning body relative to another one at `arm` from it.
  static Vec3 at_point(const Vec3& spin, const Vec3& spin_rate, const Vec3& arm) {
    return spin_rate.cross(arm) + spin.cross(spin.cross(arm));
  }

  std::array<LegLink, 3> links_;
  Vec3 foot_;  // its centre at joint angles of zero, m
};

}  // namespace hexapod
