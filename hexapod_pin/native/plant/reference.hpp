// Joint set-points over time: planned knots, or commands that arrive while the run goes on.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "laws/vectors.hpp"

namespace hexapod {

// Between knots: cubic: C1 through positions and rates; quintic: through accelerations too, those of a
// segment's both ends; held: position and rate of the knot before; linear: straight from position to
// position, with the rate of the knot before. Commands are linear, or smooth: one cubic that begins at the
// set-points and rates of the time of the command.
enum class Interpolation { cubic, quintic, held, linear, smooth_command };

// Times this close to a knot belong to what follows it, s and of the time.
constexpr double kTimeRounding = 1e-9;

// Of times that are sums of rounded ones: so close after a knot is at it, so that what holds there does
// not depend on whether more knots follow. Of the time.
constexpr double kInstant = 1e-14;

// The shortest time [s] in which a joint goes a way [rad] on a cubic that begins at rate v0 without being
// faster than `limit` on it, rates in rad/s; v1 is the rate at its end, none: the mean rate of the way. With
// a = v0 and b = v1 along the way the rate is largest in between where 3 way / time > 2 a + b and > a + 2 b,
// and there it is the limit where 3 way / time = limit + a + b + sqrt((limit - a) (limit - b)).
inline double shortest_cubic(double way, double v0, const double* v1, double limit) {
  const double sign = way < 0.0 ? -1.0 : 1.0, a = std::clamp(sign * v0, -limit, limit);
  if (v1 == nullptr) return 4.0 * std::abs(way) / (3.0 * limit + a);
  const double b = std::clamp(sign * *v1, -limit, limit);
  return 3.0 * std::abs(way) / (limit + a + b + std::sqrt((limit - a) * (limit - b)));
}

class Reference {
 public:
  // `acceleration` of quintic segments: a row for each, joints at its start, then joints at its end.
  Reference(std::vector<double> time, RowMatrix position, RowMatrix rate, Interpolation kind,
            RowMatrix acceleration = {});

  // Whether planned set-points jump from knot to knot.
  bool jumps() const { return kind_ == Interpolation::held && time_.size() > 1; }

  Eigen::Index joints() const { return position_.cols(); }

  // From now on: from where the set-points are at time t straight to `position`, there at `arrival`
  // [s], with this rate on the way and behind it, and a torque on top of the drives' own.
  void command(double t, double arrival, const VectorXd& position, const VectorXd& rate, const VectorXd& torque);

  // The same on a cubic that begins with the rates of time t and arrives with `rate`; behind it set-points
  // rest. Positions and rates are continuous where the next one begins at its arrival.
  void command_smoothly(double t, double arrival, const VectorXd& position, const VectorXd& rate,
                        const VectorXd& torque);

  // Set-points and rates with which a command at time t begins: at the end of a cubic its rates there.
  void where_to_begin(double t, VectorXd& position, VectorXd& rate);

  // More knots of planned cubics; the first of them is the last that is known. Those that lie far behind
  // are forgotten.
  void extend(const std::vector<double>& time, const RowMatrix& position, const RowMatrix& rate);

  bool can_be_extended() const { return kind_ == Interpolation::cubic && kinks_.empty(); }
  double end() const { return time_.back(); }  // of the knots, s

  // Of a step and of all within it: what holds is what holds at its start, also at its very end.
  void begin_step(double t);

  // From now on steps end where accelerations jump, and where the knots do: joints follow exactly.
  void prescribe();

  // For a sample at t, the end of a step: the value from there on; of a ramp, the value it has reached.
  void begin_sample(double t) {
    if (kind_ == Interpolation::held) row_ = row_at(t);
  }

  // The first knot after t at which the set-points or their rates jump, the last one of a motion included, or
  // the accelerations of a prescribed motion; no step may cross it.
  double next_jump(double t) const;

  // Whether t is at a knot where the set-points may jump.
  bool may_jump_at(double t) const {
    return !smooth() && rounded_up(time_[row_at(t)]) >= t;
  }

  void at(double t, VectorXd& position, VectorXd& rate);

  // With the accelerations: at a knot those of the segment that begins there, at the end of a step and of
  // the knots those of the one that ends. Set-points that are held have none.
  void at(double t, VectorXd& position, VectorXd& rate, VectorXd& acceleration);

  // Torque that the drives add to their own, N m; jumps with the set-points only.
  const VectorXd& torque() const { return torque_; }

  bool smooth() const { return kind_ == Interpolation::cubic || kind_ == Interpolation::quintic; }

  // The command that acts: a row of its time, its arrival (the same where nothing moves) and whether it is
  // smooth, two of positions, two of rates, one of torque. For a checkpoint; nothing where set-points are
  // planned.
  RowMatrix pending() const;
  // At time t, which its step has led to.
  void restore(const RowMatrix& rows, double t);

 private:
  // Share of a joint's largest acceleration by which it may jump at a knot without a step's ending there:
  // cubics between knots of a smooth motion jump by less.
  static constexpr double kSharpJump = 0.05;
  static constexpr std::size_t kKeptKnots = 1000;  // behind the one that acts: steps are interpolated
  static constexpr double kLeastJump = 1e-6;  // of the largest acceleration of any joint

  static double rounded_up(double t) { return t + kTimeRounding * std::max(1.0, std::abs(t)); }

  // At a share s of segment k_; quintic Hermite, a cubic being one of the accelerations it has.
  void on_segment(double s, VectorXd& position, VectorXd& rate, VectorXd& acceleration) const;

  void at_knot(std::size_t row, bool moving, VectorXd& position, VectorXd& rate) const;

  void along_row(double t, VectorXd& position, VectorXd& rate) const;

  void on_cubic(std::size_t k, double s, VectorXd& position, VectorXd& rate) const;

  void set_command(double t, double arrival, const VectorXd& from, const VectorXd& to, const VectorXd& torque);

  bool is_command() const { return kind_ == Interpolation::linear || kind_ == Interpolation::smooth_command; }

  void seek(double t);

  std::size_t row_at(double t) const;

  std::vector<double> time_;
  std::vector<double> kinks_;  // of a prescribed motion, s
  double limit_ = std::numeric_limits<double>::infinity();  // the first after the step's start, s
  RowMatrix position_, rate_, acceleration_;
  VectorXd torque_, unused_;
  Interpolation kind_;
  std::size_t k_ = 0, row_ = 0;
};

}  // namespace hexapod
