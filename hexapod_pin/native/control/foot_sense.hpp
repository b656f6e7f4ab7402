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
#include "control/force_targets.hpp"
#include "control/leg_chain.hpp"
#include "control/stance_forces.hpp"

namespace hexapod {

// What a robot reads, one row.
struct Readings {
  const double *q, *v, *torque, *rotation, *rate, *acceleration, *foot_force;
};

// Where a foot is to be at the end of a command, and its rate there, trunk axes; what is added to the
// angles of its joints that put it there, and to their rates.
struct LegTarget {
  Vec3 foot = Vec3::Zero(), rate = Vec3::Zero();           // m, m/s
  Vec3 offset = Vec3::Zero(), offset_rate = Vec3::Zero();  // rad, rad/s
};

using LegTargets = std::array<LegTarget, kLegs>;

// All in trunk axes; forces are in the legs' memories.
struct Felt {
  Vec3 down = -Vec3::UnitZ();  // direction of gravity
  Vec3 up = Vec3::UnitZ();     // normal of the plane of the standing feet
  Vec3 rate;                   // of the trunk, rad/s
  double roll = 0.0, pitch = 0.0;
  LegVectors foot;   // measured places of the centres, m
  LegVectors moved;  // of the contact points over the ground since the last tick, but for the trunk's way, m
  std::array<bool, kLegs> touches, free;
  LegsStatics statics;
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
    find_statics(pose, felt);
    return felt;
  }

  // Set-points and their rates [rad, rad/s] for targets of the feet, within the limits of the joints; rows of
  // one robot. `q` holds the angles that put the feet there.
  void set_points(const LegTargets& targets, double* q, double* v) const {
    for (int l = 0; l < kLegs; ++l) {
      const Vec3 rate = joint_rate(legs_[l].pose(of_leg(q, l)).jacobian, targets[l].rate) + targets[l].offset_rate;
      for (int k = 0; k < 3; ++k) {
        const std::size_t j = joints_[l][k];
        v[j] = std::clamp(rate[k], -set_.max_rate[l][k], set_.max_rate[l][k]);
        if (targets[l].offset[k] != 0.0)
          q[j] = std::clamp(q[j] + targets[l].offset[k], set_.lower[l][k], set_.upper[l][k]);
      }
    }
  }

 private:
  static constexpr double kStretched = 0.02;  // determinant of a Jacobian over its columns' lengths, -
  static constexpr double kFreeShare = 0.25;  // of the threshold: less than that is no contact, -

  static bool stretched(const Mat3& jacobian) {
    return !(std::abs(jacobian.determinant()) > kStretched * jacobian.colwise().norm().prod());
  }

  // J^-1 rate; of a stretched leg by damped least squares.
  static Vec3 joint_rate(const Mat3& jacobian, const Vec3& rate) {
    if (!stretched(jacobian)) return jacobian.inverse() * rate;
    Mat3 normal = jacobian.transpose() * jacobian;
    normal.diagonal().array() += kStretched * kStretched * normal.trace();
    return normal.inverse() * (jacobian.transpose() * rate);
  }

  static Vec3 vector(const double* at) { return {at[0], at[1], at[2]}; }

  Vec3 of_leg(const double* row, int l) const {
    return {row[joints_[l][0]], row[joints_[l][1]], row[joints_[l][2]]};
  }

  void read_leg(int l, const Readings& in, const Mat3& rotation, const LegPose& pose, ControlMemory& m,
                Felt& felt) const {
    LegMemory& leg = m.leg[l];
    const bool begun = m.begun > 0.0;
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

  void find_statics(const std::array<LegPose, kLegs>& pose, Felt& felt) const {
    Vec3 moment = set_.trunk_moment;
    for (int l = 0; l < kLegs; ++l) moment += legs_[l].mass_moment(pose[l]);
    const Vec3 centre = moment * (set_.gravity / set_.weight);
    const TrunkMotion still{Vec3::Zero(), -set_.gravity * felt.down};
    for (int l = 0; l < kLegs; ++l)
      felt.statics[l] = {sole_jacobian(l, pose[l], felt.up), pose[l].foot - set_.radius[l] * felt.up - centre,
                         legs_[l].own_torque(pose[l], still, Vec3::Zero(), Vec3::Zero())};
  }

  Mat3 sole_jacobian(int l, const LegPose& pose, const Vec3& up) const {
    Mat3 jacobian = pose.jacobian;
    for (int k = 0; k < 3; ++k) jacobian.col(k) -= pose.axis[k].cross(set_.radius[l] * up);
    return jacobian;
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
    const Mat3 jacobian = sole_jacobian(l, pose, up);
    if (stretched(jacobian)) return leg.force;
    return jacobian.transpose().inverse() * (legs_[l].own_torque(pose, trunk, v, a) - torque);
  }

  FootControlSettings set_;
  std::vector<LegChain> legs_;
  std::vector<std::array<std::size_t, 3>> joints_;
  std::vector<std::size_t> feet_;
};

}  // namespace hexapod
