// Sums and extremes over one part of a run, from its states with a time weight each (trapezoidal rule).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "laws/vectors.hpp"
#include "run/magnitude_histogram.hpp"

namespace hexapod {

struct Peak {
  double size = -1.0, value = 0.0, time = 0.0;  // |value|; < 0: nothing seen

  void see(double x, double t) {
    const double magnitude = std::abs(x);
    if (magnitude > size) size = magnitude, value = x, time = t;
  }
  void see(const Peak& other) {
    if (other.size > size) *this = other;
  }
};

// What a summary looks at in one state; linear in time between two accepted ones.
struct SummaryState {
  SummaryState(int joints, std::size_t feet)
      : angle(VectorXd::Zero(joints)), rate(angle), torque(angle), normal(VectorXd::Zero(Eigen::Index(feet))),
        slip(normal), force(Eigen::Matrix3Xd::Zero(3, Eigen::Index(feet))) {}

  void interpolate(const SummaryState& a, const SummaryState& b, double share) {
    const auto mix = [share](const auto& x, const auto& y) { return ((1.0 - share) * x + share * y).eval(); };
    time = (1.0 - share) * a.time + share * b.time;
    rise = (1.0 - share) * a.rise + share * b.rise;
    angle = mix(a.angle, b.angle), rate = mix(a.rate, b.rate), torque = mix(a.torque, b.torque);
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
  VectorXd angle, rate, torque;   // per joint
  VectorXd normal, slip;          // per foot: N; speed of the contact point on the ground, m/s
  Eigen::Matrix3Xd force;         // per foot, world axes, N
  Vec3 base = Vec3::Zero(), com = Vec3::Zero();  // m, world
  Eigen::Vector4d quaternion{0.0, 0.0, 0.0, 1.0};  // x y z w
};

class SummaryTotals {
 public:
  SummaryTotals(int joints, std::size_t feet)
      : torque_peak(std::size_t(joints)), speed_peak(torque_peak), power_peak(torque_peak),
        force_peak(feet), histogram(std::size_t(joints)) {
    sums_of_joints.setZero(joints, 5);
    sums_of_feet.setZero(Eigen::Index(feet), 6);
    lowest.setConstant(joints, kFar), highest.setConstant(joints, -kFar);
  }

  void add(const SummaryState& s, double weight, const VectorXd& limit) {
    time += weight;
    const Eigen::Index joints = s.torque.size();
    double* sum = sums_of_joints.data();
    for (Eigen::Index j = 0; j < joints; ++j) {
      const double torque = s.torque[j], rate = s.rate[j], power = torque * rate;
      sum[j] += weight * torque * torque;
      sum[joints + j] += weight * rate * rate;
      sum[2 * joints + j] += weight * std::max(power, 0.0);
      sum[3 * joints + j] += weight * std::min(power, 0.0);
      sum[4 * joints + j] += std::abs(torque) >= limit[j] ? weight : 0.0;
      lowest[j] = std::min(lowest[j], s.angle[j]), highest[j] = std::max(highest[j], s.angle[j]);
    }
    for (Eigen::Index j = 0; j < joints; ++j) {
      const std::size_t k = std::size_t(j);
      torque_peak[k].see(s.torque[j], s.time);
      speed_peak[k].see(s.rate[j], s.time);
      power_peak[k].see(s.torque[j] * s.rate[j], s.time);
      histogram[k].add(std::abs(s.torque[j]), weight);
    }
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
    lowest = lowest.cwiseMin(other.lowest), highest = highest.cwiseMax(other.highest);
    least_height = std::min(least_height, other.least_height);
    most_height = std::max(most_height, other.most_height);
    roll_peak.see(other.roll_peak), pitch_peak.see(other.pitch_peak);
    for (std::size_t j = 0; j < histogram.size(); ++j) {
      torque_peak[j].see(other.torque_peak[j]), speed_peak[j].see(other.speed_peak[j]);
      power_peak[j].see(other.power_peak[j]), histogram[j].take(other.histogram[j]);
    }
    for (std::size_t f = 0; f < force_peak.size(); ++f) force_peak[f].see(other.force_peak[f]);
    other.clear();
  }

  static constexpr double kFar = 1e300;

  double time = 0.0, acceleration_square = 0.0;  // s; m^2/s^3
  // columns per joint: integrals of torque^2, rate^2, power > 0, power < 0; time at the limit
  Eigen::ArrayXXd sums_of_joints;
  // columns per foot: integrals of normal force, force (3, world), slip speed; time loaded
  Eigen::ArrayXXd sums_of_feet;
  VectorXd lowest, highest;  // joint angles, rad
  std::vector<Peak> torque_peak, speed_peak, power_peak, force_peak;
  std::vector<MagnitudeHistogram> histogram;  // of |torque|
  double height = 0.0, roll = 0.0, pitch = 0.0, roll_square = 0.0, pitch_square = 0.0;  // integrals
  double least_height = kFar, most_height = -kFar;
  Peak roll_peak, pitch_peak;

 private:
  void add_feet(const SummaryState& s, double weight) {
    for (std::size_t f = 0; f < force_peak.size(); ++f) {
      const auto i = Eigen::Index(f);
      if (s.normal[i] <= 0.0) continue;
      force_peak[f].see(s.normal[i], s.time);
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
    for (auto* peaks : {&torque_peak, &speed_peak, &power_peak, &force_peak})
      std::fill(peaks->begin(), peaks->end(), Peak());
  }
};

}  // namespace hexapod
