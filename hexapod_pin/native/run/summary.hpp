// Summary of a run, gathered at its accepted states without keeping samples: over whole gait cycles of
// a window, however early the run ends. Peaks are those of accepted states; integrals follow the trapezoidal rule
// between them; a cycle that begins between two states begins at the linear interpolant.
#pragma once

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "run/summary_totals.hpp"

namespace hexapod {

// A foot at one state.
struct FootLoad {
  Vec3 force = Vec3::Zero();  // on the robot, world axes, N
  double normal = 0.0;        // along the ground's normal, N
  double slip = 0.0;          // speed of the contact point along the ground where loaded, m/s
  double rubbing = 0.0;       // |friction force . velocity of the contact point|, W
};

// The feet of an evaluated plant; of two contacts of a foot, the more loaded one slips.
template <class PlantT>
void read_feet(const PlantT& plant, std::vector<FootLoad>& out) {
  for (std::size_t f = 0; f < out.size(); ++f) {
    out[f] = FootLoad();
    double most = 0.0;
    for (std::size_t i = f * plant.per_foot; i < (f + 1) * plant.per_foot; ++i) {
      const auto& foot = plant.feet[i];
      if (!foot.active) continue;
      const Vec3& up = foot.ground.normal;
      const double normal = up.dot(foot.contact.force);
      out[f].force += foot.contact.force;
      out[f].normal += normal;
      const Vec3 slip = foot.velocity - up * up.dot(foot.velocity);
      out[f].rubbing += std::abs(foot.contact.force.dot(slip));
      if (normal <= most) continue;
      most = normal;
      out[f].slip = slip.norm();
    }
  }
}

// Where the robot is at an edge of a half cycle.
struct PathPoint {
  double time, x, y, yaw;  // s; centre of mass, m; trunk, rad
};

class RunSummary {
 public:
  RunSummary(int joints, std::size_t feet)
      : limit_(ArrayXd::Constant(joints, kNever)), kept_(3, SummaryState(joints, feet)),
        window_(joints, feet), cycle_(window_), outside_torque_(joints),
        outside_force_(Eigen::Index(feet)) {}

  // Whole cycles of length `cycle` from `begin`, none of which ends after `end`; without a cycle (0)
  // all states from `begin` to `end`. Before the first record; s.
  void set_window(double begin, double end, double cycle) {
    begin_ = next_edge_ = begin, end_ = end, period_ = cycle;
  }

  // Torques from which a joint counts as being at its limit (kLimitShare of it), N m, in the states
  // that follow.
  void set_limit(const VectorXd& limit) { limit_ = limit.array(); }

  // An accepted state, the initial one included; times do not decrease.
  void record(double t, const VectorXd& q, const VectorXd& v, const VectorXd& torque,
              const std::vector<FootLoad>& feet, const Vec3& com) {
    read(t, q, v, torque, feet, com);
    if (states_++ == 0) return begin_here();
    while (next_edge_ <= next().time + rounding(next().time)) pass_edge();
    advance_to(next_);
  }

  // Everything below may be asked at any time.
  SummaryTotals& totals() {
    if (period_ == 0.0 && inside_) add_last_state(0.0), window_.take(cycle_);
    return window_;
  }
  long cycles() const { return cycles_; }  // whole ones; 0 where nothing repeats
  long states() const { return states_; }
  double period() const { return period_; }
  // Whether a state at t would end a half cycle or the window.
  bool ends_at(double t) const { return next_edge_ <= t + rounding(t); }
  double first_yaw() const { return first_yaw_; }
  std::vector<PathPoint> path() const {  // at the edges of the half cycles, or at both ends
    std::vector<PathPoint> points = path_;
    if (period_ == 0.0 && inside_) points.push_back(path_point());
    else if (period_ > 0.0) points.resize(cycles_ > 0 ? std::size_t(2 * cycles_ + 1) : 0);
    return points;
  }
  Peaks outside_torque() {
    return outside(outside_torque_, cycle_.joints.peaks(&JointSums::torque), last().torque);
  }
  Peaks outside_force() const {
    return outside(outside_force_, cycle_.force_peak, last().normal);
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  SummaryState& last() { return kept_[last_]; }
  const SummaryState& last() const { return kept_[last_]; }
  SummaryState& next() { return kept_[next_]; }

  // Times closer than this are the same, s.
  static double rounding(double t) { return 1e-9 * std::max(1.0, std::abs(t)); }

  void read(double t, const VectorXd& q, const VectorXd& v, const VectorXd& torque,
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
  }

  // The initial state: cycles that had begun before it are not whole.
  void begin_here() {
    std::swap(last_, next_);
    first_yaw_ = last().yaw();
    const double late = last().time - rounding(last().time) - next_edge_;
    if (late > 0.0) begin_ += period_ > 0.0 ? std::ceil(late / period_) * period_ : late;
    next_edge_ = begin_;
    if (next_edge_ <= last().time + rounding(last().time)) cross_edge();
  }

  // The last state's share of time is known when the next one is.
  void add_last_state(double half_step) {
    if (inside_) {
      cycle_.add(last(), weight_ + half_step);
    } else {
      outside_torque_.see(last().torque, last().time);
      outside_force_.see(last().normal, last().time);
    }
    weight_ = 0.0;
  }

  void advance_to(std::size_t& state) {
    const double step = kept_[state].time - last().time;
    add_last_state(0.5 * step);
    if (inside_) cycle_.add_interval(last(), kept_[state]);
    weight_ = inside_ ? 0.5 * step : 0.0;
    std::swap(last_, state);
  }

  void pass_edge() {
    const double edge = std::min(next_edge_, next().time), step = next().time - last().time;
    if (edge > last().time) {
      kept_[edge_].interpolate(last(), next(), (edge - last().time) / step);
      advance_to(edge_);
    }
    add_last_state(0.0);
    cross_edge();
  }

  // The last state stands at the next edge.
  void cross_edge() {
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

  PathPoint path_point() const { return {last().time, last().com.x(), last().com.y(), last().yaw()}; }

  // A cycle that is not whole yet is outside, and so is the last state where the window does not go on.
  Peaks outside(Peaks peaks, const Peaks& unfinished, const ArrayXd& values) const {
    if (period_ > 0.0) peaks.see(unfinished);
    if (period_ > 0.0 || !inside_) peaks.see(values, last().time);
    return peaks;
  }

  ArrayXd limit_;
  double begin_ = 0.0, end_ = kNever, period_ = 0.0, next_edge_ = 0.0;  // s
  std::vector<SummaryState> kept_;  // these three take turns
  std::size_t last_ = 0, next_ = 1, edge_ = 2;
  SummaryTotals window_, cycle_;  // whole cycles; the one that goes on
  Peaks outside_torque_, outside_force_;
  std::vector<PathPoint> path_;
  double weight_ = 0.0;  // time that the last state stands for so far, s
  double first_yaw_ = 0.0;
  bool inside_ = false;  // the last state's next step belongs to the window
  long halves_ = 0, cycles_ = 0, states_ = 0;
};

}  // namespace hexapod
