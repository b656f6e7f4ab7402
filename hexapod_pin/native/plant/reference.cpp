#include "plant/reference.hpp"

#include <algorithm>
#include <utility>

namespace hexapod {

Reference::Reference(std::vector<double> time, RowMatrix position, RowMatrix rate, Interpolation kind,
                     RowMatrix acceleration)
    : time_(std::move(time)), position_(std::move(position)), rate_(std::move(rate)),
      acceleration_(std::move(acceleration)), torque_(VectorXd::Zero(position_.cols())), kind_(kind) {}

void Reference::command(double t, double arrival, const VectorXd& position, const VectorXd& rate,
                        const VectorXd& torque) {
  VectorXd here(joints()), unused(joints());
  where_to_begin(t, here, unused);
  set_command(t, arrival, here, position, torque);
  rate_.row(0) = rate_.row(1) = rate.transpose();
  kind_ = Interpolation::linear;
}

void Reference::command_smoothly(double t, double arrival, const VectorXd& position, const VectorXd& rate,
                                 const VectorXd& torque) {
  VectorXd here(joints()), rate_here(joints());
  where_to_begin(t, here, rate_here);
  set_command(t, arrival, here, position, torque);
  rate_.row(0) = rate_here.transpose();
  rate_.row(1) = rate.transpose();
  kind_ = Interpolation::smooth_command;
}

void Reference::set_command(double t, double arrival, const VectorXd& from, const VectorXd& to,
                            const VectorXd& torque) {
  const bool moves = arrival > t;
  time_ = {t, moves ? arrival : std::numeric_limits<double>::infinity()};
  position_.resize(2, joints());
  rate_.resize(2, joints());
  position_.row(0) = (moves ? from : to).transpose();
  position_.row(1) = to.transpose();
  torque_ = torque;
  k_ = row_ = 0;
}

void Reference::where_to_begin(double t, VectorXd& position, VectorXd& rate) {
  begin_step(t);
  if (kind_ != Interpolation::smooth_command || t > rounded_up(time_[1])) return at(t, position, rate);
  row_ = 0;
  along_row(t, position, rate);
}

void Reference::extend(const std::vector<double>& time, const RowMatrix& position, const RowMatrix& rate) {
  const std::size_t first = k_ > kKeptKnots ? k_ - kKeptKnots : 0, kept = time_.size() - first;
  const Eigen::Index more = Eigen::Index(time.size()) - 1;
  time_.erase(time_.begin(), time_.begin() + std::ptrdiff_t(first));
  time_.insert(time_.end(), time.begin() + 1, time.end());
  for (auto [own, added] : {std::pair{&position_, &position}, std::pair{&rate_, &rate}}) {
    RowMatrix all(Eigen::Index(kept) + more, joints());
    all << own->bottomRows(Eigen::Index(kept)), added->bottomRows(more);
    *own = std::move(all);
  }
  k_ -= first;
}

void Reference::begin_step(double t) {
  if (!smooth()) row_ = row_at(t);
  else limit_ = next_jump(t);
}

void Reference::prescribe() {
  if (!smooth() || time_.size() < 2) return;
  kinks_.push_back(time_.back());
  VectorXd q(joints()), v(q), before(q), after(q), largest = VectorXd::Zero(joints());
  RowMatrix jumps = RowMatrix::Zero(Eigen::Index(time_.size()), joints());
  for (k_ = 0; k_ + 1 < time_.size(); ++k_) {
    on_segment(0.0, q, v, after);
    if (k_ > 0) jumps.row(Eigen::Index(k_)) = (after - before).cwiseAbs().transpose();
    on_segment(1.0, q, v, before);
    largest = largest.cwiseMax(after.cwiseAbs()).cwiseMax(before.cwiseAbs());
  }
  largest = largest.cwiseMax(kLeastJump * largest.maxCoeff());
  for (k_ = 1; k_ + 1 < time_.size(); ++k_)
    if ((jumps.row(Eigen::Index(k_)).transpose().array() > kSharpJump * largest.array()).any())
      kinks_.push_back(time_[k_]);
  std::sort(kinks_.begin(), kinks_.end());
  k_ = 0;
}

double Reference::next_jump(double t) const {
  if (smooth()) {
    const auto next = std::upper_bound(kinks_.begin(), kinks_.end(), rounded_up(t));
    const double end = time_.back(), never = std::numeric_limits<double>::infinity();
    const bool stops = end > rounded_up(t) && rate_.row(rate_.rows() - 1).any();
    return std::min(next == kinks_.end() ? never : *next, stops ? end : never);
  }
  const std::size_t row = row_at(t);
  return row + 1 < time_.size() ? time_[row + 1] : std::numeric_limits<double>::infinity();
}

void Reference::at(double t, VectorXd& position, VectorXd& rate) {
  if (!smooth()) return along_row(t, position, rate);
  const std::size_t last = time_.size() - 1;
  if (t <= time_.front() || last == 0) return at_knot(0, t == time_.front(), position, rate);
  if (t >= time_.back()) return at_knot(last, t <= time_.back() + kTimeRounding, position, rate);
  seek(t);
  if (t - time_[k_] <= kInstant * t) t = time_[k_];
  const double s = (t - time_[k_]) / (time_[k_ + 1] - time_[k_]);
  if (kind_ == Interpolation::quintic) return on_segment(s, position, rate, unused_);
  on_cubic(k_, s, position, rate);
}

inline void Reference::on_cubic(std::size_t k, double s, VectorXd& position, VectorXd& rate) const {
  const double h = time_[k + 1] - time_[k], s2 = s * s, s3 = s2 * s;
  const auto p0 = position_.row(k), p1 = position_.row(k + 1);
  const auto m0 = rate_.row(k), m1 = rate_.row(k + 1);
  position = ((2 * s3 - 3 * s2 + 1) * p0 + (3 * s2 - 2 * s3) * p1 + h * (s3 - 2 * s2 + s) * m0 +
              h * (s3 - s2) * m1).transpose();
  rate = (6 * (s2 - s) / h * (p0 - p1) + (3 * s2 - 4 * s + 1) * m0 + (3 * s2 - 2 * s) * m1)
             .transpose();
}

void Reference::at(double t, VectorXd& position, VectorXd& rate, VectorXd& acceleration) {
  if (!smooth() || time_.size() < 2 || t > time_.back() + kTimeRounding) {
    at(t, position, rate);
    acceleration.setZero(joints());
    return;
  }
  double inside = std::clamp(t, time_.front(), std::min(limit_, time_.back()));
  seek(inside);
  if (inside - time_[k_] <= kInstant * inside) inside = time_[k_];
  if (time_[k_] >= limit_) --k_;
  on_segment((inside - time_[k_]) / (time_[k_ + 1] - time_[k_]), position, rate, acceleration);
}

RowMatrix Reference::pending() const {
  if (!is_command() || time_.size() != 2) return {};
  RowMatrix rows = RowMatrix::Zero(6, std::max<Eigen::Index>(joints(), 3));
  rows(0, 0) = time_[0], rows(0, 1) = std::isfinite(time_[1]) ? time_[1] : time_[0];
  rows(0, 2) = kind_ == Interpolation::smooth_command ? 1.0 : 0.0;
  rows.block(1, 0, 2, joints()) = position_;
  rows.block(3, 0, 2, joints()) = rate_;
  rows.block(5, 0, 1, joints()) = torque_.transpose();
  return rows;
}

void Reference::restore(const RowMatrix& rows, double t) {
  if (rows.rows() == 0) return;
  const Eigen::Index n = joints();
  const bool moves = rows(0, 1) > rows(0, 0);
  time_ = {rows(0, 0), moves ? rows(0, 1) : std::numeric_limits<double>::infinity()};
  position_ = rows.block(1, 0, 2, n);
  rate_ = rows.block(3, 0, 2, n);
  torque_ = rows.block(5, 0, 1, n).transpose();
  kind_ = rows(0, 2) != 0.0 ? Interpolation::smooth_command : Interpolation::linear;
  k_ = 0;
  row_ = t > time_[1] + kTimeRounding * std::max(1.0, std::abs(t)) ? 1 : 0;
}

inline void Reference::on_segment(double s, VectorXd& position, VectorXd& rate, VectorXd& acceleration) const {
  const double h = time_[k_ + 1] - time_[k_];
  const Eigen::Index n = joints(), k = Eigen::Index(k_);
  position.resize(n), rate.resize(n), acceleration.resize(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double p = position_(k, j), d = position_(k + 1, j) - p;
    const double m0 = h * rate_(k, j), m1 = h * rate_(k + 1, j);
    double c2 = 3.0 * d - 2.0 * m0 - m1, c3 = m0 + m1 - 2.0 * d, c4 = 0.0, c5 = 0.0;
    if (kind_ == Interpolation::quintic) {
      const double a0 = h * h * acceleration_(k, j), a1 = h * h * acceleration_(k, n + j);
      c2 = 0.5 * a0;
      c3 = 10.0 * d - 6.0 * m0 - 4.0 * m1 - 1.5 * a0 + 0.5 * a1;
      c4 = -15.0 * d + 8.0 * m0 + 7.0 * m1 + 1.5 * a0 - a1;
      c5 = 6.0 * d - 3.0 * m0 - 3.0 * m1 - 0.5 * a0 + 0.5 * a1;
    }
    position[j] = p + s * (m0 + s * (c2 + s * (c3 + s * (c4 + s * c5))));
    rate[j] = (m0 + s * (2.0 * c2 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))) / h;
    acceleration[j] = (2.0 * c2 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5))) / (h * h);
  }
}

inline void Reference::at_knot(std::size_t row, bool moving, VectorXd& position, VectorXd& rate) const {
  position = position_.row(row).transpose();
  if (moving) rate = rate_.row(row).transpose();
  else rate.setZero(position.size());
}

inline void Reference::along_row(double t, VectorXd& position, VectorXd& rate) const {
  position = position_.row(row_).transpose();
  rate = rate_.row(row_).transpose();
  if (kind_ == Interpolation::smooth_command && row_ > 0) rate.setZero();
  if (kind_ == Interpolation::held || row_ + 1 >= time_.size()) return;
  const double length = time_[row_ + 1] - time_[row_];
  if (!(length < std::numeric_limits<double>::infinity())) return;
  const double share = std::clamp((t - time_[row_]) / length, 0.0, 1.0);
  if (kind_ == Interpolation::smooth_command) return on_cubic(row_, share, position, rate);
  position += share * (position_.row(row_ + 1) - position_.row(row_)).transpose();
}

// The segment with time_[k] <= t < time_[k+1]; steps move it by one at most.
inline void Reference::seek(double t) {
  if (t < time_[k_] || k_ + 2 >= time_.size() || t >= time_[k_ + 2])
    k_ = std::upper_bound(time_.begin(), time_.end(), t) - time_.begin() - 1;
  else if (t >= time_[k_ + 1]) ++k_;
  k_ = std::min(k_, time_.size() - 2);
}

std::size_t Reference::row_at(double t) const {
  const auto next = std::upper_bound(time_.begin(), time_.end(), rounded_up(t));
  return next == time_.begin() ? 0 : std::size_t(next - time_.begin()) - 1;
}

}  // namespace hexapod
