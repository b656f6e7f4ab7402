// Joint set-points: C1 piecewise cubic through knots (time, position, rate), held beyond the ends.
#pragma once

#include <algorithm>
#include <vector>

#include <Eigen/Core>

namespace hexapod {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class Reference {
 public:
  Reference(std::vector<double> time, RowMatrix position, RowMatrix rate)
      : time_(std::move(time)), position_(std::move(position)), rate_(std::move(rate)) {}

  void at(double t, Eigen::VectorXd& position, Eigen::VectorXd& rate) {
    const std::size_t last = time_.size() - 1;
    if (t <= time_.front() || last == 0) return hold(0, t == time_.front(), position, rate);
    if (t >= time_.back()) return hold(last, t == time_.back(), position, rate);
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
  void hold(std::size_t row, bool moving, Eigen::VectorXd& position, Eigen::VectorXd& rate) const {
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

  std::vector<double> time_;
  RowMatrix position_, rate_;
  std::size_t k_ = 0;
};

}  // namespace hexapod
