#include "run/summary.hpp"

#include <algorithm>

namespace hexapod {

RunSummary::RunSummary(int joints, std::size_t feet)
    : limit_(ArrayXd::Constant(joints, kNever)), kept_(3, SummaryState(joints, feet)), window_(joints, feet),
      cycle_(window_), outside_torque_(joints), outside_force_(Eigen::Index(feet)) {}

RunSummary::RunSummary(const RunSummary&) = default;

RunSummary::~RunSummary() = default;

void RunSummary::record(double t, const VectorXd& q, const VectorXd& v, const VectorXd& torque,
                        const std::vector<FootLoad>& feet, const Vec3& com) {
  read(t, q, v, torque, feet, com);
  if (states_++ == 0) return begin_here();
  while (next_edge_ <= next().time + rounding(next().time)) pass_edge();
  advance_to(next_);
}

SummaryTotals& RunSummary::totals() {
  if (period_ == 0.0 && inside_) add_last_state(0.0), window_.take(cycle_);
  return window_;
}

void RunSummary::keep_peaks(Eigen::Index width) {
  width += limit_.size() + 3 * last().normal.size();
  for (SummaryState& state : kept_) state.whole.setZero(width);
  window_.joints.keep_states(width), cycle_.joints.keep_states(width);
}

RowMatrix RunSummary::peak_states() {
  const Peaks peaks = totals().joints.peaks(&JointSums::torque);
  const RowMatrix& states = totals().joints.at_peak();
  RowMatrix out(states.rows(), states.cols() + 1);
  for (Eigen::Index j = 0; j < out.rows(); ++j) {
    if (peaks.size[j] < 0.0) out.row(j).setConstant(std::nan(""));
    else out.row(j) << peaks.time[j], states.row(j);
  }
  return out;
}

std::vector<PathPoint> RunSummary::path() const {
  std::vector<PathPoint> points = path_;
  if (period_ == 0.0 && inside_) points.push_back(path_point());
  else if (period_ > 0.0) points.resize(cycles_ > 0 ? std::size_t(2 * cycles_ + 1) : 0);
  return points;
}

Peaks RunSummary::outside_torque() {
  return outside(outside_torque_, cycle_.joints.peaks(&JointSums::torque), last().torque);
}

Peaks RunSummary::outside_force() const {
  return outside(outside_force_, cycle_.force_peak, last().normal);
}

inline void RunSummary::read(double t, const VectorXd& q, const VectorXd& v, const VectorXd& torque,
                      const std::vector<FootLoad>& feet, const Vec3& com) {
  const Eigen::Index joints = torque.size();
  SummaryState& s = next();
  s.time = t;
  s.angle = q.tail(joints), s.rate = v.tail(joints), s.torque = torque, s.limit = limit_;
  s.base = q.head<3>(), s.quaternion = q.segment<4>(3), s.com = com;
  const auto& p = s.quaternion;  // last row of the rotation matrix times the base's velocity
  s.rise = 2.0 * (p[0] * p[2] - p[3] * p[1]) * v[0] +
           2.0 * (p[1] * p[2] + p[3] * p[0]) * v[1] +
           (1.0 - 2.0 * (p[0] * p[0] + p[1] * p[1])) * v[2];
  s.roll_rate = v[3], s.pitch_rate = v[4];
  for (std::size_t f = 0; f < feet.size(); ++f) {
    const auto i = Eigen::Index(f);
    s.normal[i] = feet[f].normal, s.slip[i] = feet[f].slip, s.rubbing[i] = feet[f].rubbing;
    s.force.col(i) = feet[f].force;
  }
  if (s.whole.size() > 0) s.whole << q.array(), v.array(), torque.array(), s.force.reshaped().array();
}

inline void RunSummary::begin_here() {
  std::swap(last_, next_);
  first_yaw_ = last().yaw();
  const double late = last().time - rounding(last().time) - next_edge_;
  if (late > 0.0) begin_ += period_ > 0.0 ? std::ceil(late / period_) * period_ : late;
  next_edge_ = begin_;
  if (next_edge_ <= last().time + rounding(last().time)) cross_edge();
}

inline void RunSummary::add_last_state(double half_step) {
  if (inside_) {
    cycle_.add(last(), weight_ + half_step);
  } else {
    outside_torque_.see(last().torque, last().time);
    outside_force_.see(last().normal, last().time);
  }
  weight_ = 0.0;
}

inline void RunSummary::advance_to(std::size_t& state) {
  const double step = kept_[state].time - last().time;
  add_last_state(0.5 * step);
  if (inside_) cycle_.add_interval(last(), kept_[state]);
  weight_ = inside_ ? 0.5 * step : 0.0;
  std::swap(last_, state);
}

inline void RunSummary::pass_edge() {
  const double edge = std::min(next_edge_, next().time), step = next().time - last().time;
  if (edge > last().time) {
    kept_[edge_].interpolate(last(), next(), (edge - last().time) / step);
    advance_to(edge_);
  }
  add_last_state(0.0);
  cross_edge();
}

inline void RunSummary::cross_edge() {
  path_.push_back(path_point());
  const bool cycle_begins = period_ == 0.0 || halves_ % 2 == 0;
  if (inside_ && cycle_begins) {
    window_.take(cycle_);
    if (period_ > 0.0) ++cycles_;
  }
  const bool goes_on = period_ > 0.0 ? begin_ + double(cycles_ + 1) * period_ <= end_ + rounding(end_)
                                     : !inside_;
  inside_ = goes_on || !cycle_begins;
  ++halves_;
  if (!inside_) next_edge_ = kNever;
  else next_edge_ = period_ > 0.0 ? begin_ + 0.5 * double(halves_) * period_ : end_;
}

inline Peaks RunSummary::outside(Peaks peaks, const Peaks& unfinished, const ArrayXd& values) const {
  if (period_ > 0.0) peaks.see(unfinished);
  if (period_ > 0.0 || !inside_) peaks.see(values, last().time);
  return peaks;
}

}  // namespace hexapod
