// Sums and extremes over one part of a run, from its states with a time weight each (trapezoidal rule).
#pragma once

#include <algorithm>

#include "run/joint_totals.hpp"
#include "run/line_fit.hpp"
#include "run/peaks.hpp"
#include "run/summary_state.hpp"

namespace hexapod {

class SummaryTotals {
  static constexpr double kFar = 1e300;

 public:
  SummaryTotals(int joints_, std::size_t feet) : joints(joints_), force_peak(Eigen::Index(feet)) {
    sums_of_feet.setZero(Eigen::Index(feet), 7);
  }

  void add(const SummaryState& s, double weight) {
    time += weight;
    joints.add(s, weight);
    add_feet(s, weight);
    add_trunk(s, weight);
  }

  // What lies between two states: their accelerations.
  void add_interval(const SummaryState& a, const SummaryState& b) {
    const double step = b.time - a.time, change_of_rise = b.rise - a.rise;
    if (!(step > 0.0)) return;
    acceleration_square += change_of_rise * change_of_rise / step;
    joints.add_interval(step, a, b);
  }

  void take(SummaryTotals& other) {  // and empties it
    time += other.time, acceleration_square += other.acceleration_square;
    joints.take(other.joints);
    sums_of_feet += other.sums_of_feet;
    heave += other.heave;
    height += other.height, roll += other.roll, pitch += other.pitch;
    roll_square += other.roll_square, pitch_square += other.pitch_square;
    roll_rate_square += other.roll_rate_square, pitch_rate_square += other.pitch_rate_square;
    least_height = std::min(least_height, other.least_height);
    most_height = std::max(most_height, other.most_height);
    if (other.roll_peak.size > roll_peak.size) roll_peak = other.roll_peak;
    if (other.pitch_peak.size > pitch_peak.size) pitch_peak = other.pitch_peak;
    force_peak.take(other.force_peak);
    other.clear();
  }

  double time = 0.0, acceleration_square = 0.0;  // s; m^2/s^3
  JointTotals joints;
  // columns per foot: integrals of normal force, force (3, world), slip speed; time loaded; friction power
  Eigen::ArrayXXd sums_of_feet;
  Peaks force_peak;
  double height = 0.0, roll = 0.0, pitch = 0.0, roll_square = 0.0, pitch_square = 0.0;  // integrals
  double roll_rate_square = 0.0, pitch_rate_square = 0.0;  // rad^2/s
  LineFit heave;  // of the height over time
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
      sums_of_feet(i, 6) += weight * s.rubbing[i];
    }
  }

  void add_trunk(const SummaryState& s, double weight) {
    const double z = s.base.z(), r = s.roll(), p = s.pitch();
    height += weight * z, roll += weight * r, pitch += weight * p;
    roll_square += weight * r * r, pitch_square += weight * p * p;
    roll_rate_square += weight * s.roll_rate * s.roll_rate;
    pitch_rate_square += weight * s.pitch_rate * s.pitch_rate;
    heave.add(s.time, z, weight);
    least_height = std::min(least_height, z), most_height = std::max(most_height, z);
    roll_peak.see(r, s.time), pitch_peak.see(p, s.time);
  }

  void clear() {  // joints and forces are empty already
    time = acceleration_square = height = roll = pitch = roll_square = pitch_square = 0.0;
    roll_rate_square = pitch_rate_square = 0.0;
    heave.clear();
    sums_of_feet.setZero();
    least_height = kFar, most_height = -kFar;
    roll_peak = pitch_peak = Peak();
  }
};

}  // namespace hexapod
