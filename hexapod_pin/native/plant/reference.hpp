// Joint set-points over time: planned knots, or commands that arrive while the run goes on.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "laws/vectors.hpp"

namespace hexapod {

// Between knots: cubic: C1 through positions and rates; held: position and rate of the knot before;
// linear: straight from position to position, with the rate of the knot before. Commands are linear.
enum class Interpolation { cubic, held, linear };

// Times this close to a knot belong to what follows it, s and of the time.
constexpr double kTimeRounding = 1e-9;

class Reference {
 public:
  Reference(std::vector<double> time, RowMatrix position, RowMatrix rate, Interpolation kind)
      : time_(std::move(time)), position_(std::move(position)), rate_(std::move(rate)),
        torque_(VectorXd::Zero(position_.cols())), kind_(kind) {}

  // Whether planned set-points jump from knot to knot.
  bool jumps() const { return kind_ == Interpolation::held && time_.size() > 1; }

  Eigen::Index joints() const { return position_.cols(); }

  // From now on: from where the set-points are at time t straight to `position`, there at `arrival`
  // [s], with this rate on the way and `rate_after` behind it, and a torque on top of the drives' own.
  void command(double t, double arrival, const VectorXd& position, const VectorXd& rate,
               const VectorXd& rate_after, const VectorXd& torque) {
    VectorXd here(joints()), unused(joints());
    begin_step(t);
    at(t, here, unused);
    const bool moves = arrival > t;
    time_ = {t, moves ? arrival : std::numeric_limits<double>::infinity()};
    position_.resize(2, joints());
    rate_.resize(2, joints());
    position_.row(0) = (moves ? here : position).transpose();
    position_.row(1) = position.transpose();
    rate_.row(0) = (moves ? rate : rate_after).transpose();
    rate_.row(1) = rate_after.transpose();
    torque_ = torque;
    kind_ = Interpolation::linear;
    k_ = row_ = 0;
  }

  // Of a step and of all within it: what holds is what holds at its start, also at its very end.
  void begin_step(double t) {
    if (kind_ != Interpolation::cubic) row_ = row_at(t);
  }

  // For a sample at t, the end of a step: what is held from there on; of a way, what it has led to.
  void begin_sample(double t) {
    if (kind_ == Interpolation::held) row_ = row_at(t);
  }

  // The first knot after t at which the set-points or their rates jump; no step may cross it.
  double next_jump(double t) const {
    if (kind_ == Interpolation::cubic) return std::numeric_limits<double>::infinity();
    const std::size_t row = row_at(t);
    return row + 1 < time_.size() ? time_[row + 1] : std::numeric_limits<double>::infinity();
  }

  void at(double t, VectorXd& position, VectorXd& rate) {
    if (kind_ != Interpolation::cubic) return along_row(t, position, rate);
    const std::size_t last = time_.size() - 1;
    if (t <= time_.front() || last == 0) return at_knot(0, t == time_.front(), position, rate);
    if (t >= time_.back()) return at_knot(last, t <= time_.back() + kTimeRounding, position, rate);
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

  // Torque that the drives add to their own, N m; jumps with the set-points only.
  const VectorXd& torque() const { return torque_; }

  // The command that acts: a row of its time and arrival (the same where nothing moves), two of
  // positions, two of rates, one of torque. For a checkpoint; nothing where set-points are planned.
  RowMatrix pending() const {
    if (kind_ != Interpolation::linear || time_.size() != 2) return {};
    RowMatrix rows = RowMatrix::Zero(6, std::max<Eigen::Index>(joints(), 2));
    rows(0, 0) = time_[0], rows(0, 1) = std::isfinite(time_[1]) ? time_[1] : time_[0];
    rows.block(1, 0, 2, joints()) = position_;
    rows.block(3, 0, 2, joints()) = rate_;
    rows.block(5, 0, 1, joints()) = torque_.transpose();
    return rows;
  }
  // At time t, which its step has led to.
  void restore(const RowMatrix& rows, double t) {
    if (rows.rows() == 0) return;
    const Eigen::Index n = joints();
    const bool moves = rows(0, 1) > rows(0, 0);
    time_ = {rows(0, 0), moves ? rows(0, 1) : std::numeric_limits<double>::infinity()};
    position_ = rows.block(1, 0, 2, n);
    rate_ = rows.block(3, 0, 2, n);
    torque_ = rows.block(5, 0, 1, n).transpose();
    kind_ = Interpolation::linear;
    k_ = 0;
    row_ = t > time_[1] + kTimeRounding * std::max(1.0, std::abs(t)) ? 1 : 0;
  }

 private:
  void at_knot(std::size_t row, bool moving, VectorXd& position, VectorXd& rate) const {
    position = position_.row(row).transpose();
    if (moving) rate = rate_.row(row).transpose();
    else rate.setZero(position.size());
  }

  void along_row(double t, VectorXd& position, VectorXd& rate) const {
    position = position_.row(row_).transpose();
    rate = rate_.row(row_).transpose();
    if (kind_ == Interpolation::held || row_ + 1 >= time_.size()) return;
    const double length = time_[row_ + 1] - time_[row_];
    if (!(length < std::numeric_limits<double>::infinity())) return;
    const double share = std::clamp((t - time_[row_]) / length, 0.0, 1.0);
    position += share * (position_.row(row_ + 1) - position_.row(row_)).transpose();
  }

  void seek(double t) {  // the segment with time_[k] <= t < time_[k+1]; steps move it by one at most
    if (t < time_[k_] || k_ + 2 >= time_.size() || t >= time_[k_ + 2])
      k_ = std::upper_bound(time_.begin(), time_.end(), t) - time_.begin() - 1;
    else if (t >= time_[k_ + 1]) ++k_;
    k_ = std::min(k_, time_.size() - 2);
  }

  std::size_t row_at(double t) const {
    const double late = t + kTimeRounding * std::max(1.0, std::abs(t));
    const auto next = std::upper_bound(time_.begin(), time_.end(), late);
    return next == time_.begin() ? 0 : std::size_t(next - time_.begin()) - 1;
  }

  std::vector<double> time_;
  RowMatrix position_, rate_;
  VectorXd torque_;
  Interpolation kind_;
  std::size_t k_ = 0, row_ = 0;
};

}  // namespace hexapod
