// Joint set-points through knots (time, position, rate): C1 piecewise cubic, or held from knot to knot.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "laws/vectors.hpp"

namespace hexapod {

class Reference {
 public:
  Reference(std::vector<double> time, RowMatrix position, RowMatrix rate, bool held)
      : time_(std::move(time)), position_(std::move(position)), rate_(std::move(rate)), held_(held) {}

  // Held set-points of a step are those at its start, also at its very end.
  void begin_step(double t) {
    if (held_) step_row_ = row_at(t);
  }

  // The first jump after t; no step may cross it.
  double next_jump(double t) const {
    if (!held_) return std::numeric_limits<double>::infinity();
    const std::size_t row = row_at(t);
    return row + 1 < time_.size() ? time_[row + 1] : std::numeric_limits<double>::infinity();
  }

  void at(double t, VectorXd& position, VectorXd& rate) {
    const std::size_t last = time_.size() - 1;
    if (held_) return hold(step_row_, false, position, rate);
    if (t <= time_.front() || last == 0) return hold(0, t == time_.front(), position, rate);
    if (t >= time_.back()) return hold(last, t <= time_.back() + kRounding, position, rate);
    seek(t);
    const double h = time_[k_ + 1] - time_[k_], s = (t - time_[k_]) / h;
    const double s2 = s * s, s3 = s2 * s;
    const auto p0 = position_.row(k_), p1 = position_.row(k_ + 1);
    const auto m0 = rate_.row(k_), m1 = rate_.row(k_ + 1);
    position = ((2 * s3 - 3 * s2 + 1) * p0 + (3 * s2 - 2 * s3) * p1 + h * (s3 - 2 * s2 + s) * m0 +
                h * (s3 - s2) * m1).transpose();
    rate = (6 * (s2 - s) / h * (p0 - p1) + (3 * s2 - 4 * s + 1) * m0 + (3 * s2 - 2 * s) * m1)
               .transpose();
  }

 private:
  void hold(std::size_t row, bool moving, VectorXd& position, VectorXd& rate) const {
    position = position_.row(row).transpose();
    if (moving) rate = rate_.row(row).transpose();
    else rate.setZero(position.size());
  }

  void seek(double t) {  // the segment with time_[k] <= t < time_[k+1]; steps move it by one at most
    if (t < time_[k_] || k_ + 2 >= time_.size() || t >= time_[k_ + 2])
      k_ = std::upper_bound(time_.begin(), time_.end(), t) - time_.begin() - 1;
    else if (t >= time_[k_ + 1]) ++k_;
    k_ = std::min(k_, time_.size() - 2);
  }

  static constexpr double kRounding = 1e-9;  // s: the last step may end slightly after the last knot

  // the row held at t; a time within rounding of a knot belongs to what follows it
  std::size_t row_at(double t) const {
    const double late = t + kRounding * std::max(1.0, std::abs(t));
    const auto next = std::upper_bound(time_.begin(), time_.end(), late);
    return next == time_.begin() ? 0 : std::size_t(next - time_.begin()) - 1;
  }

  std::vector<double> time_;
  RowMatrix position_, rate_;
  bool held_;
  std::size_t k_ = 0, step_row_ = 0;
};

}  // namespace hexapod
