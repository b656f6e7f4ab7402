#pragma once

#include <algorithm>
#include <cmath>

#include "laws/vectors.hpp"

namespace hexapod {

using Eigen::ArrayXd;

// Share of a torque limit [-] from which a torque is at it, whatever the round-off.
constexpr double kLimitShare = 0.999;

// What a summary looks at in one state; linear in time between two accepted ones.
struct SummaryState {
  SummaryState(int joints, std::size_t feet)
      : angle(ArrayXd::Zero(joints)), rate(angle), torque(angle), limit(angle),
        normal(ArrayXd::Zero(Eigen::Index(feet))), slip(normal), rubbing(normal),
        force(Eigen::Matrix3Xd::Zero(3, Eigen::Index(feet))) {}

  void interpolate(const SummaryState& a, const SummaryState& b, double share) {
    const auto mix = [share](const auto& x, const auto& y) { return ((1.0 - share) * x + share * y).eval(); };
    time = (1.0 - share) * a.time + share * b.time;
    rise = (1.0 - share) * a.rise + share * b.rise;
    angle = mix(a.angle, b.angle), rate = mix(a.rate, b.rate), torque = mix(a.torque, b.torque);
    limit = b.limit;
    normal = mix(a.normal, b.normal), slip = mix(a.slip, b.slip);
    rubbing = mix(a.rubbing, b.rubbing), force = mix(a.force, b.force);
    roll_rate = (1.0 - share) * a.roll_rate + share * b.roll_rate;
    pitch_rate = (1.0 - share) * a.pitch_rate + share * b.pitch_rate;
    base = mix(a.base, b.base), com = mix(a.com, b.com);
    quaternion = mix(a.quaternion, b.quaternion);
    if (whole.size() == 0) return;
    whole = mix(a.whole, b.whole);
    whole.segment<4>(3).matrix().normalize();
  }

  // Angles of Rz(yaw) Ry(pitch) Rx(roll), rad; the quaternion need not have length 1.
  double roll() const {
    const auto &p = quaternion;
    return std::atan2(2.0 * (p[3] * p[0] + p[1] * p[2]),
                      p[3] * p[3] - p[0] * p[0] - p[1] * p[1] + p[2] * p[2]);
  }
  double pitch() const {
    const auto &p = quaternion;
    const double sine = 2.0 * (p[3] * p[1] - p[2] * p[0]) / p.squaredNorm();
    return std::asin(std::clamp(sine, -1.0, 1.0));
  }
  double yaw() const {
    const auto &p = quaternion;
    return std::atan2(2.0 * (p[3] * p[2] + p[0] * p[1]),
                      p[3] * p[3] + p[0] * p[0] - p[1] * p[1] - p[2] * p[2]);
  }

  double time = 0.0, rise = 0.0;  // s; vertical velocity of the trunk, m/s
  double roll_rate = 0.0, pitch_rate = 0.0;  // of the trunk about its own x and y axes, rad/s
  ArrayXd angle, rate, torque;    // per joint
  ArrayXd limit;                  // torque from which a joint is at its limit, N m
  ArrayXd normal, slip;           // per foot: N; speed of the contact point on the ground, m/s
  ArrayXd rubbing;                // per foot: |friction force . velocity of the contact point|, W
  Eigen::Matrix3Xd force;         // per foot, world axes, N
  Vec3 base = Vec3::Zero(), com = Vec3::Zero();  // m, world
  ArrayXd whole;  // q, v, torques, forces on the feet; none where no states are kept
  Eigen::Vector4d quaternion{0.0, 0.0, 0.0, 1.0};  // x y z w
};

}  // namespace hexapod
