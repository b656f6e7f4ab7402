// Sums and extremes over one part of a run, from its states with a time weight each (trapezoidal rule).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "laws/vectors.hpp"
#include "run/magnitude_histogram.hpp"

namespace hexapod {

using Eigen::ArrayXd;

struct Peak {
  double size = -1.0, value = 0.0, time = 0.0;  // |value|; < 0: nothing seen

  void see(double x, double t) {
    const double magnitude = std::abs(x);
    if (magnitude > size) size = magnitude, value = x, time = t;
  }
};

// A peak per joint or foot.
struct Peaks {
  explicit Peaks(Eigen::Index count) { clear(count); }
  void clear(Eigen::Index count) {
    size.setConstant(count, -1.0), value.setZero(count), time.setZero(count);
  }

  void see(const ArrayXd& x, double t) {
    if (x.size() == 0 || (x.abs() - size).maxCoeff() <= 0.0) return;
    for (Eigen::Index k = 0; k < x.size(); ++k) see(k, x[k], t);
  }
  void see(Eigen::Index k, double x, double t) {
    const double magnitude = std::abs(x);
    if (magnitude > size[k]) size[k] = magnitude, value[k] = x, time[k] = t;
  }
  void see(const Peaks& other) {
    for (Eigen::Index k = 0; k < size.size(); ++k)
      if (other.size[k] > size[k]) see(k, other.value[k], other.time[k]);
  }

  ArrayXd size, value, time;  // |value|, < 0 where nothing was seen
};

// What a summary looks at in one state; linear in time between two accepted ones.
struct SummaryState {
  SummaryState(int joints, std::size_t feet)
      : angle(ArrayXd::Zero(joints)), rate(angle), torque(angle), limit(angle),
        normal(ArrayXd::Zero(Eigen::Index(feet))), slip(normal), force(Eigen::Matrix3Xd::Zero(3, Eigen::Index(feet))) {}

  void interpolate(const SummaryState& a, const SummaryState& b, double share) {
    const auto mix = [share](const auto& x, const auto& y) { return ((1.0 - share) * x + share * y).eval(); };
    time = (1.0 - share) * a.time + share * b.time;
    rise = (1.0 - share) * a.rise + share * b.rise;
    angle = mix(a.angle, b.angle), rate = mix(a.rate, b.rate), torque = mix(a.torque, b.torque);
    limit = b.limit;
    normal = mix(a.normal, b.normal), slip = mix(a.slip, b.slip), force = mix(a.force, b.force);
    base = mix(a.base, b.base), com = mix(a.com, b.com);
    quaternion = mix(a.quaternion, b.quaternion);
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
  ArrayXd angle, rate, torque;    // per joint
  ArrayXd limit;                  // torque from which a joint is at its limit, N m
  ArrayXd normal, slip;           // per foot: N; speed of the contact point on the ground, m/s
  Eigen::Matrix3Xd force;         // per foot, world axes, N
  Vec3 base = Vec3::Zero(), com = Vec3::Zero();  // m, world
  Eigen::Vector4d quaternion{0.0, 0.0, 0.0, 1.0};  // x y z w
};

class SummaryTotals {
  static constexpr double kFar = 1e300;

 public:
  SummaryTotals(int joints, std::size_t feet)
      : torque_peak(joints), speed_peak(joints), power_peak(joints), force_peak(Eigen::Index(feet)),
        histogram(std::size_t(joints)) {
    sums_of_joints.setZero(joints, 5);
    sums_of_feet.setZero(Eigen::Index(feet), 6);
    lowest.setConstant(joints, kFar), highest.setConstant(joints, -kFar);
  }

  void add(const SummaryState& s, double weight) {
    time += weight;
    power_ = s.torque * s.rate;
    size_ = s.torque.abs();
    sums_of_joints.col(0) += weight * size_.square();
    sums_of_joints.col(1) += weight * s.rate.square();
    sums_of_joints.col(2) += weight * power_.max(0.0);
    sums_of_joints.col(3) += weight * power_.min(0.0);
    if (size_.size() > 0 && (size_ - s.limit).maxCoeff() >= 0.0)
      sums_of_joints.col(4) += weight * (size_ >= s.limit).cast<double>();
    lowest = lowest.min(s.angle), highest = highest.max(s.angle);
    for (std::size_t j = 0; j < histogram.size(); ++j)
      histogram[j].add(size_[Eigen::Index(j)], weight);
    torque_peak.see(s.torque, s.time), speed_peak.see(s.rate, s.time);
    power_peak.see(power_, s.time);
    add_feet(s, weight);
    add_trunk(s, weight);
  }

  // What lies between two states: their vertical acceleration.
  void add_interval(double step, double change_of_rise) {
    if (step > 0.0) acceleration_square += change_of_rise * change_of_rise / step;
  }

  void take(SummaryTotals& other) {  // and empties it
    time += other.time, acceleration_square += other.acceleration_square;
    sums_of_joints += other.sums_of_joints, sums_of_feet += other.sums_of_feet;
    height += other.height, roll += other.roll, pitch += other.pitch;
    roll_square += other.roll_square, pitch_square += other.pitch_square;
    lowest = lowest.min(other.lowest), highest = highest.max(other.highest);
    least_height = std::min(least_height, other.least_height);
    most_height = std::max(most_height, other.most_height);
    if (other.roll_peak.size > roll_peak.size) roll_peak = other.roll_peak;
    if (other.pitch_peak.size > pitch_peak.size) pitch_peak = other.pitch_peak;
    torque_peak.see(other.torque_peak), speed_peak.see(other.speed_peak);
    power_peak.see(other.power_peak), force_peak.see(other.force_peak);
    for (std::size_t j = 0; j < histogram.size(); ++j) histogram[j].take(other.histogram[j]);
    other.clear();
  }

  double time = 0.0, acceleration_square = 0.0;  // s; m^2/s^3
  // columns per joint: integrals of torque^2, rate^2, power > 0, power < 0; time at the limit
  Eigen::ArrayXXd sums_of_joints;
  // columns per foot: integrals of normal force, force (3, world), slip speed; time loaded
  Eigen::ArrayXXd sums_of_feet;
  ArrayXd lowest, highest;  // joint angles, rad
  Peaks torque_peak, speed_peak, power_peak, force_peak;
  std::vector<MagnitudeHistogram> histogram;  // of |torque|
  double height = 0.0, roll = 0.0, pitch = 0.0, roll_square = 0.0, pitch_square = 0.0;  // integrals
  double least_height = kFar, most_height = -kFar;
  Peak roll_peak, pitch_peak;

 private:
  void add_feet(const SummaryState& s, double weight) {
    for (Eigen::Index i = 0; i < s.normal.size(); ++i) {
      if (s.normal[i] <= 0.0) continue;
      force_peak.see(i, s.normal[i], s.time);
      sums_of_feet(i, 0) += weight * s.normal[i];
      for (int k = 0; k < 3; ++k) sums_of_feet(i, 1 + k) += weight * s.force(k, i);
      sums_of_feet(i, 4) += weight * s.slip[i];
      sums_of_feet(i, 5) += weight;
    }
  }

  void add_trunk(const SummaryState& s, double weight) {
    const double z = s.base.z(), r = s.roll(), p = s.pitch();
    height += weight * z, roll += weight * r, pitch += weight * p;
    roll_square += weight * r * r, pitch_square += weight * p * p;
    least_height = std::min(least_height, z), most_height = std::max(most_height, z);
    roll_peak.see(r, s.time), pitch_peak.see(p, s.time);
  }

  void clear() {  // histograms are empty already
    time = acceleration_square = height = roll = pitch = roll_square = pitch_square = 0.0;
    sums_of_joints.setZero(), sums_of_feet.setZero();
    lowest.setConstant(kFar), highest.setConstant(-kFar);
    least_height = kFar, most_height = -kFar;
    roll_peak = pitch_peak = Peak();
    for (Peaks* peaks : {&torque_peak, &speed_peak, &power_peak, &force_peak})
      peaks->clear(peaks->size.size());
  }

  ArrayXd power_, size_;  // of the state being added
};

}  // namespace hexapod
