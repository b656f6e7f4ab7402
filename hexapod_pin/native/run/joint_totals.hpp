// Sums, extremes and histograms of the joints over states with a time weight each. States wait in a block that
// is then taken joint by joint: a joint's sums stay in registers and its histogram in the nearest cache.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "run/magnitude_histogram.hpp"
#include "run/peaks.hpp"
#include "run/summary_state.hpp"

namespace hexapod {

// Of one joint: integrals over time, peaks, and the least and largest angle.
struct JointSums {
  double torque_square = 0.0, rate_square = 0.0;             // N^2 m^2 s, rad^2/s
  double positive_energy = 0.0, negative_energy = 0.0;       // J
  double driving_power = 0.0, braking_power = 0.0;           // largest power given, and taken up, W
  double at_limit = 0.0;                                     // s
  double limit_use = 0.0;  // largest |torque| over its limit in the same state
  double lowest = std::numeric_limits<double>::infinity();   // rad
  double highest = -std::numeric_limits<double>::infinity();
  Peak torque, speed, power;

  void take(const JointSums& other) {
    torque_square += other.torque_square, rate_square += other.rate_square;
    positive_energy += other.positive_energy, negative_energy += other.negative_energy;
    driving_power = std::max(driving_power, other.driving_power);
    braking_power = std::max(braking_power, other.braking_power);
    at_limit += other.at_limit, limit_use = std::max(limit_use, other.limit_use);
    lowest = std::min(lowest, other.lowest), highest = std::max(highest, other.highest);
    torque.see(other.torque), speed.see(other.speed), power.see(other.power);
  }
};

class JointTotals {
 public:
  explicit JointTotals(int joints)
      : acceleration_square(ArrayXd::Zero(joints)), torque_acceleration(acceleration_square),
        sums_(std::size_t(joints)), histogram_(std::size_t(joints)), block_(std::size_t(joints)) {}

  // From now on the states are kept in which torques are largest: all numbers of `SummaryState::whole`.
  void keep_states(Eigen::Index width) {
    whole_.assign(kBlock, ArrayXd::Zero(width));
    at_peak_.setZero(Eigen::Index(sums_.size()), width);
  }

  void add(const SummaryState& s, double weight) {
    time_[waiting_] = s.time, weight_[waiting_] = weight;
    if (!whole_.empty()) whole_[waiting_] = s.whole;
    for (std::size_t j = 0; j < block_.size(); ++j) {
      const auto k = Eigen::Index(j);
      block_[j][waiting_] = {s.torque[k], s.rate[k], s.angle[k], s.limit[k]};
    }
    if (++waiting_ == kBlock) flush();
  }

  // What lies between two states: the change of rate, at the mean torque.
  void add_interval(double step, const SummaryState& a, const SummaryState& b) {
    acceleration_square += (b.rate - a.rate).square() / step;
    torque_acceleration += 0.5 * (a.torque + b.torque) * (b.rate - a.rate);
  }

  void take(JointTotals& other) {  // and empties it
    flush(), other.flush();
    acceleration_square += other.acceleration_square;
    torque_acceleration += other.torque_acceleration;
    other.acceleration_square.setZero(), other.torque_acceleration.setZero();
    for (std::size_t j = 0; j < sums_.size(); ++j) {
      if (!whole_.empty() && other.sums_[j].torque.size > sums_[j].torque.size)
        at_peak_.row(Eigen::Index(j)) = other.at_peak_.row(Eigen::Index(j));
      sums_[j].take(other.sums_[j]);
      histogram_[j].take(other.histogram_[j]);
      other.sums_[j] = JointSums();
    }
  }

  const std::vector<JointSums>& sums() { return flush(), sums_; }
  Peaks peaks(Peak JointSums::*which) {
    flush();
    Peaks found{Eigen::Index(sums_.size())};
    for (std::size_t j = 0; j < sums_.size(); ++j) found.set(Eigen::Index(j), sums_[j].*which);
    return found;
  }
  const RowMatrix& at_peak() { return flush(), at_peak_; }  // a row per joint, as kept
  const std::vector<MagnitudeHistogram>& histogram() { return flush(), histogram_; }  // of |torque|

  // Integrals over time of rate'^2, rad^2/s^3, and of torque rate', N m rad/s.
  ArrayXd acceleration_square, torque_acceleration;

 private:
  static constexpr std::size_t kBlock = 16;

  struct Entry {
    double torque, rate, angle, limit;
  };

  void flush() {
    for (std::size_t j = 0; j < block_.size(); ++j) flush_joint(j);
    waiting_ = 0;
  }

  // Adds the block to the sums of a joint; the torques of a budget begin here.
  void flush_joint(std::size_t j) {
    JointSums sums = sums_[j];
    MagnitudeHistogram& histogram = histogram_[j];
    std::size_t top = kBlock;  // of the block's states, the one with the largest torque so far
    for (std::size_t i = 0; i < waiting_; ++i) {
      const Entry& e = block_[j][i];
      const double weight = weight_[i], size = std::abs(e.torque), power = e.torque * e.rate;
      sums.torque_square += weight * (size * size);
      sums.rate_square += weight * (e.rate * e.rate);
      sums.positive_energy += weight * std::max(power, 0.0);
      sums.negative_energy += weight * std::min(power, 0.0);
      sums.driving_power = std::max(sums.driving_power, power);
      sums.braking_power = std::max(sums.braking_power, -power);
      if (size >= e.limit) sums.at_limit += weight;
      sums.limit_use = std::max(sums.limit_use, kLimitShare * size / e.limit);
      sums.lowest = std::min(sums.lowest, e.angle), sums.highest = std::max(sums.highest, e.angle);
      histogram.add(size, weight);
      if (sums.torque.see(e.torque, time_[i])) top = i;
      sums.speed.see(e.rate, time_[i]);
      sums.power.see(power, time_[i]);
    }
    sums_[j] = sums;
    if (top < kBlock && !whole_.empty()) at_peak_.row(Eigen::Index(j)) = whole_[top].matrix().transpose();
  }

  std::vector<JointSums> sums_;
  std::vector<MagnitudeHistogram> histogram_;
  std::size_t waiting_ = 0;  // states in the block
  std::array<double, kBlock> time_, weight_;
  std::vector<std::array<Entry, kBlock>> block_;
  std::vector<ArrayXd> whole_;  // of the states in the block; none: they are not kept
  RowMatrix at_peak_;
};

}  // namespace hexapod
