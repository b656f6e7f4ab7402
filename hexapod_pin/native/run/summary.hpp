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
  RunSummary(int joints, std::size_t feet);

  RunSummary(const RunSummary& other);
  ~RunSummary();

  // Whole cycles of length `cycle` from `begin`, none of which ends after `end`; without a cycle (0)
  // all states from `begin` to `end`. Before the first record; s.
  void set_window(double begin, double end, double cycle) {
    begin_ = next_edge_ = begin, end_ = end, period_ = cycle;
  }

  // Torques from which a joint counts as being at its limit (kLimitShare of it), N m, in the states
  // that follow.
  void set_limit(const VectorXd& limit) { limit_ = limit.array(); }

  // From now on the states are kept in which the torques of joints are largest; `width`: numbers of q and v.
  void keep_peaks(Eigen::Index width);

  // An accepted state, the initial one included; times do not decrease.
  void record(double t, const VectorXd& q, const VectorXd& v, const VectorXd& torque,
              const std::vector<FootLoad>& feet, const Vec3& com);

  // Everything below may be asked at any time.
  SummaryTotals& totals();
  long cycles() const { return cycles_; }  // whole ones; 0 where nothing repeats
  long states() const { return states_; }
  double period() const { return period_; }
  // Whether a state at t would end a half cycle or the window.
  bool ends_at(double t) const { return next_edge_ <= t + rounding(t); }
  double first_yaw() const { return first_yaw_; }
  std::vector<PathPoint> path() const;  // at the edges of the half cycles, or at both ends
  Peaks outside_torque();
  // A row per joint: time of the largest torque in the window, and q, v, torques, forces on the feet then; NaN
  // where there is none, no rows where they are not kept.
  RowMatrix peak_states();
  Peaks outside_force() const;

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  SummaryState& last() { return kept_[last_]; }
  const SummaryState& last() const { return kept_[last_]; }
  SummaryState& next() { return kept_[next_]; }

  // Times closer than this are the same, s.
  static double rounding(double t) { return 1e-9 * std::max(1.0, std::abs(t)); }

  void read(double t, const VectorXd& q, const VectorXd& v, const VectorXd& torque,
            const std::vector<FootLoad>& feet, const Vec3& com);

  // The initial state: cycles that had begun before it are not whole.
  void begin_here();

  // The last state's share of time is known when the next one is.
  void add_last_state(double half_step);

  void advance_to(std::size_t& state);

  void pass_edge();

  // The last state stands at the next edge.
  void cross_edge();

  PathPoint path_point() const { return {last().time, last().com.x(), last().com.y(), last().yaw()}; }

  // A cycle that is not whole yet is outside, and so is the last state where the window does not go on.
  Peaks outside(Peaks peaks, const Peaks& unfinished, const ArrayXd& values) const;

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
