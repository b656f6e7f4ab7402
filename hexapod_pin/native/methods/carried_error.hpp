// The error of a run, found while it runs: what each step may have lost moves along with the linearised
// motion, e <- (I - h J)^-1 e + local error, through contacts and drives as the stiff block has them. Where a law
// remembers the speed at which a foot has touched down, that speed has an error, too, and the force by it.
// Coriolis forces are not among them: what flies and spins is not followed. What shows that the error may
// be another is counted.
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "methods/chart_flow.hpp"
#include "methods/stiff_block.hpp"
#include "run/step_observer.hpp"

namespace hexapod {

template <class PlantT>
class CarriedError {
 public:
  CarriedError(const ChartFlow<PlantT>& flow, StepObserver& observer)
      : observer_(observer), block_(flow.plant), error_(VectorXd::Zero(flow.size())),
        touches_(flow.plant.law.normal.needs_touch_speed() ? flow.plant.feet.size() : 0) {}

  // A step of h [s] with this local error has ended at y, where the plant has been evaluated.
  void add(ChartFlow<PlantT>& flow, const VectorXd& y, const VectorXd& local, double h) {
    const auto touches = [](const auto& foot) { return foot.active; };
    if (std::none_of(flow.plant.feet.begin(), flow.plant.feet.end(), touches))
      free_turn_ += h * flow.velocity().template segment<3>(3).norm();
    block_.capture(flow.plant, flow.xi(y));
    block_.factor(flow.plant, h);
    for (std::size_t i = 0; i < touches_.size(); ++i) add_damper_error(flow.plant, i);
    block_.solve(flow.xi(error_), flow.v(error_), flow.z(error_));
    for (std::size_t i = 0; i < touches_.size(); ++i) follow_touch(flow.plant.feet[i], i, h);
    const Eigen::Index states = error_.size() - flow.nw;
    error_.head(states) += local.head(states);
    if (error_.allFinite() && error_.cwiseAbs().maxCoeff() <= kLargest) return;
    error_.setZero();  // no state is to be evaluated so far away
    lost_ = true;
  }

  // Shows the observer where the error leads at the end (t, y) of a step, if it looks; the plant is
  // evaluated at y before and after.
  void show_step(ChartFlow<PlantT>& flow, double t, const VectorXd& y) {
    if (!observer_.looks_at_step(t)) return;
    displaced_ = y + error_;
    flow.save_evaluation();
    flow.evaluate(t, displaced_);
    observer_.displaced_step(t, flow.position(), flow.velocity());
    flow.restore_evaluation(t, y);
  }

  // Shows the observer where it leads at a sample (t, y) in the last step. The contacts' forces are off by
  // what the laws at its end give.
  void show_sample(ChartFlow<PlantT>& flow, double t, const VectorXd& y) {
    displaced_ = y + error_;
    flow.state(t, displaced_, q_, v_);
    const double force = observer_.looks_at_forces()
        ? block_.largest_force_change(flow.xi(error_), flow.v(error_), flow.z(error_)) : 0.0;
    observer_.displaced_sample(t, q_, v_, force);
  }

  // A touch-down, a slip or a switch at t: where many follow each other some may be missed.
  void happened(double t) {
    recent_.push_back(t);
    while (t - recent_.front() > kBurstTime) recent_.pop_front();
    burst_ = std::max(burst_, recent_.size());
  }

  // The chart's origin moves to y.
  void move_chart(ChartFlow<PlantT>& flow, const VectorXd& y) {
    chart_.capture(flow.xi(y).template segment<3>(3));
    auto xi = flow.xi(error_);
    xi.template head<3>() = (chart_.linear.transpose() * xi.template head<3>()).eval();
    xi.template segment<3>(3) = (chart_.angular_inverse * xi.template segment<3>(3)).eval();
  }

  void add_counters(std::map<std::string, double>& all) const {
    all["free_turn"] = free_turn_;
    all["burst"] = double(burst_);
    all["error_lost"] = double(lost_);
  }

 private:
  static constexpr double kLargest = 1.0;  // m, rad, m/s and rad/s, that a linearised motion can follow
  static constexpr double kBurstTime = 0.05;  // s, in which events are counted

  // Of a foot in the air the speed at which it approaches; in the ground, the error of that remembered.
  struct Touch {
    double approach = 0.0;  // m/s, at the end of the last step
    double error = 0.0;     // m/s
  };

  // The force of a damper whose gain is that of another touch speed.
  void add_damper_error(const PlantT& plant, std::size_t i) {
    const auto& foot = plant.feet[i];
    if (!foot.active || !foot.memory.touching || touches_[i].error == 0.0) return;
    const NormalLaw& law = plant.law.normal;
    const double speed = foot.memory.touch_speed, other = std::max(0.0, speed + touches_[i].error);
    const double gain = law.damping_gain(other) - law.damping_gain(speed);
    const double rate = -foot.ground.normal.dot(foot.velocity);
    block_.add_force(i, foot.k_scale * law.spring(-foot.ground.gap) * gain * rate * foot.ground.normal);
  }

  // A foot that has touched down in the step of h: displaced by the error it would have done so earlier or
  // later, and at another speed. The slower it approaches, the more: a foot that hardly moves gains all of its
  // speed in the time between.
  template <class Contact>
  void follow_touch(const Contact& foot, std::size_t i, double h) {
    Touch& touch = touches_[i];
    const double approach = foot.ground.gap < kFarAway ? -foot.ground.normal.dot(foot.velocity) : 0.0;
    if (foot.active && !foot.memory.touching) {
      const auto [gap, leaving] = block_.gap_change(i);
      const double speed = approach - leaving, gained = 2.0 * (approach - touch.approach) / h * gap;
      touch.error = std::sqrt(std::max(0.0, speed * speed + gained)) - approach;
    } else if (!foot.active) {
      touch.error = 0.0;
    }
    touch.approach = approach;
  }

  StepObserver& observer_;
  StiffBlock<PlantT> block_;
  ChartMap chart_;
  VectorXd error_;  // its works are 0
  VectorXd displaced_, q_, v_;
  std::vector<Touch> touches_;  // of each foot, where the law remembers them
  std::deque<double> recent_;  // events, s
  std::size_t burst_ = 0;      // most of them in kBurstTime
  bool lost_ = false;          // it has grown beyond kLargest
  double free_turn_ = 0.0;     // turned while no foot touches, rad
};

}  // namespace hexapod
