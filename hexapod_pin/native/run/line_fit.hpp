// Weighted mean and least-squares line of values over time, kept as moments about the first point seen, which
// does not cancel where time or value is far from zero.
#pragma once

#include <algorithm>
#include <cmath>

namespace hexapod {

class LineFit {
 public:
  void add(double time, double value, double weight) {
    if (!started_) started_ = true, origin_time_ = time, origin_value_ = value;
    const double t = time - origin_time_, z = value - origin_value_;
    w_ += weight, t_ += weight * t, z_ += weight * z;
    tt_ += weight * t * t, tz_ += weight * t * z, zz_ += weight * z * z;
  }

  LineFit& operator+=(const LineFit& other) {
    if (!other.started_) return *this;
    if (!started_) return *this = other;
    const double dt = other.origin_time_ - origin_time_, dz = other.origin_value_ - origin_value_;
    w_ += other.w_, t_ += other.t_ + other.w_ * dt, z_ += other.z_ + other.w_ * dz;
    tt_ += other.tt_ + dt * (2.0 * other.t_ + other.w_ * dt);
    tz_ += other.tz_ + dt * other.z_ + dz * (other.t_ + other.w_ * dt);
    zz_ += other.zz_ + dz * (2.0 * other.z_ + other.w_ * dz);
    return *this;
  }

  void clear() { *this = LineFit(); }

  // Root mean square about the mean, and about the line.
  double rms_about_mean() const { return std::sqrt(variance()); }
  double rms_about_line() const {
    const double spread = tt_ - t_ * t_ / w_, common = tz_ - t_ * z_ / w_;
    const double explained = spread > 0.0 ? common * common / (spread * w_) : 0.0;
    return std::sqrt(std::max(0.0, variance() - explained));
  }

 private:
  double variance() const { return std::max(0.0, (zz_ - z_ * z_ / w_) / w_); }

  bool started_ = false;
  double origin_time_ = 0.0, origin_value_ = 0.0;
  double w_ = 0.0, t_ = 0.0, z_ = 0.0, tt_ = 0.0, tz_ = 0.0, zz_ = 0.0;
};

}  // namespace hexapod
