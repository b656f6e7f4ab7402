// What the readings of one robot say of its feet and its trunk.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "control/control_memory.hpp"
#include "control/foot_control_settings.hpp"
#include "control/leg_chain.hpp"
#include "control/stance_forces.hpp"

namespace hexapod {

// What a robot reads, one row.
struct Readings {
  const double *q, *v, *torque, *rotation, *rate, *acceleration, *foot_force;
};

// All in trunk axes; forces are in the legs' memories.
struct Felt {
  Vec3 down = -Vec3::UnitZ();  // direction of gravity
  Vec3 up = Vec3::UnitZ();     // normal of the plane of the standing feet
  Vec3 rate;                   // of the trunk, rad/s
  double roll = 0.0, pitch = 0.0;
  LegVectors foot;   // measured places of the centres, m
  LegVectors moved;  // of the contact points over the ground since the last tick, but for the trunk's way, m
  std::array<bool, kLegs> touches, free;
  std::array<Mat3, kLegs> give;  // of a foot to the force on it: J diag(1/kp) J^T, m/N
};

class FootSense {
 public:
  FootSense(const FootControlSettings& settings, std::vector<LegChain> legs,
            std::vector<std::array<std::size_t, 3>> joints, std::vector<std::size_t> feet)
      : set_(settings), legs_(std::move(legs)), joints_(std::move(joints)), feet_(std::move(feet)) {}

  // Whether rows of so many joints and feet hold those of the legs.
  bool fits(std::size_t joints, std::size_t feet) const {
    bool good = legs_.size() == kLegs && joints_.size() == kLegs && feet_.size() == kLegs;
    for (const auto& leg : joints_)
      for (const std::size_t j : leg) good = good && j < joints;
    for (const std::size_t f : feet_) good = good && f < feet;
    return good;
  }

  Felt read(const Readings& in, ControlMemory& m) const {
    Felt felt;
    const Mat3 rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(in.rotation);
    felt.down = -rotation.row(2).transpose();
    felt.roll = std::atan2(rotation(2, 1), rotation(2, 2));
    felt.pitch = std::asin(std::clamp(-rotation(2, 0), -1.0, 1.0));
    felt.rate = vector(in.rate);
    std::array<LegPose, kLegs> pose;
    LegNumbers standing;
    for (int l = 0; l < kLegs; ++l) {
      pose[l] = legs_[l].pose(of_leg(in.q, l));
      felt.foot[l] = pose[l].foot;
      standing[l] = m.leg[l].phase.on_ground() ? 1.0 : 0.0;
    }
    const Vec3 plane = fitted_plane(felt.foot, standing);
    felt.up = Vec3(-plane[1], -plane[2], 1.0).normalized();
    for (int l = 0; l < kLegs; ++l) read_leg(l, in, rotation, pose[l], m, felt);
    return felt;
  }

 private:
  static constexpr double kStretched = 0.02;  // determinant of a Jacobian over its columns' lengths, -
  static constexpr double kFreeShare = 0.25;  // of the threshold: less than that is no contact, -

  static Vec3 vector(const double* at) { return {at[0], at[1], at[2]}; }

  Vec3 of_leg(const double* row, int l) const {
    return {row[joints_[l][0]], row[joints_[l][1]], row[joints_[l][2]]};
  }

  void read_leg(int l, const Readings& in, const Mat3& rotation, const LegPose& pose, ControlMemory& m,
                Felt& felt) const {
    LegMemory& leg = m.leg[l];
    const bool begun = m.begun > 0.0;
    felt.give[l] = pose.jacobian * set_.give[l].asDiagonal() * pose.jacobian.transpose();
    felt.moved[l] = begun ? moved(l, in, pose, leg, felt) : Vec3::Zero();
    leg.foot = pose.foot;
    const Vec3 force = set_.source == ForceSource::foot
                           ? Vec3(rotation.transpose() * vector(in.foot_force + 3 * feet_[l]))
                           : estimated(l, in, pose, leg, begun, felt.up);
    leg.rates = of_leg(in.v, l);
    const double keep = begun ? set_.filter_time / (set_.filter_time + set_.period) : 0.0;
    leg.force = keep * leg.force + (1.0 - keep) * force;
    felt.touches[l] = leg.force.norm() > set_.threshold;
    felt.free[l] = leg.force.norm() < kFreeShare * set_.threshold;
  }

  // A sphere rolls without sliding.
  Vec3 moved(int l, const Readings& in, const LegPose& pose, const LegMemory& leg, const Felt& felt) const {
    Vec3 spin = felt.rate;
    for (int k = 0; k < 3; ++k) spin += pose.axis[k] * in.v[joints_[l][k]];
    const Vec3 turned = felt.rate.cross(pose.foot) - spin.cross(set_.radius[l] * felt.up);
    return pose.foot - leg.foot + set_.period * turned;
  }

  // Force on the sole from the torques of the joints: J^-T (own torque - torque). A stretched leg, from
  // which it is not known, keeps the last one.
  Vec3 estimated(int l, const Readings& in, const LegPose& pose, const LegMemory& leg, bool begun,
                 const Vec3& up) const {
    const Vec3 v = of_leg(in.v, l);
    const Vec3 a = begun ? Vec3((v - leg.rates) / set_.period) : Vec3::Zero();
    const TrunkMotion trunk{vector(in.rate), vector(in.acceleration)};
    Vec3 torque = of_leg(in.torque, l);
    if (set_.source == ForceSource::torque) torque -= legs_[l].friction(v);
    Mat3 jacobian = pose.jacobian;  // of the sole
    for (int k = 0; k < 3; ++k) jacobian.col(k) -= pose.axis[k].cross(set_.radius[l] * up);
    const Vec3 size = jacobian.colwise().norm();
    if (!(std::abs(jacobian.determinant()) > kStretched * size.prod())) return leg.force;
    return jacobian.transpose().inverse() * (legs_[l].own_torque(pose, trunk, v, a) - torque);
  }

  FootControlSettings set_;
  std::vector<LegChain> legs_;
  std::vector<std::array<std::size_t, 3>> joints_;
  std::vector<std::size_t> feet_;
};

}  // namespace hexapod
