// Numerical differentiation formulas of order 1 to 5 (Shampine & Reichelt, 1997): quasi-constant steps
// that pass over samples, simplified Newton with the stiff block, a new history where the right-hand
// side has a kink: at jumps of the set-points, touch-downs and switches of the drives.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "methods/backward_differences.hpp"
#include "methods/carried_error.hpp"
#include "methods/error_control.hpp"
#include "methods/chart_flow.hpp"
#include "methods/drive_events.hpp"
#include "methods/ndf_newton.hpp"
#include "methods/resolution.hpp"
#include "methods/touch_down_locator.hpp"
#include "run/step_observer.hpp"
#include "run/rollout.hpp"

namespace hexapod {

template <class PlantT>
class NdfDriver {
 public:
  static constexpr bool kRestarts = true;  // a run that goes on from a checkpoint has a new history

  NdfDriver(PlantT& plant, Reference& reference, const Resolution& resolution,
            const std::vector<double>& /*memory*/, StepObserver& observer)
      : flow_(plant, reference), observer_(observer),
        tolerance_(scene_share(plant, reference) * kToleranceShare * resolution.tolerance),
        norm_{tolerance_, kLeastVelocityWeight, resolution.refinement * plant.law.friction.steepness()},
        newton_(flow_, norm_), drives_(flow_, norm_),
        touch_(plant.feet.size(), kTouchTolerances * tolerance_, plant.law.normal.needs_touch_speed()),
        carried_(flow_, observer) {
    plant.located_depth = std::max(kLocatedTouchDepth, kLocatedTolerances * tolerance_);
  }

  // From t to `stop`, in steps that may end beyond it but not beyond `horizon`, the set-points' next
  // jump. The plant is evaluated at (t, q, v) before and at `stop` after. False: no step of a
  // reasonable size is accurate enough, or the run is to end.
  bool advance(double t, double stop, double horizon, VectorXd& q, VectorXd& v,
               EnergyLedger& ledger) {
    if (interpolated_) flow_.plant.restore_evaluation();
    interpolated_ = false;
    if (history_.empty()) begin(t, q, v);
    while (time_ < stop) {
      if (!memories_updated_) update_memories();
      if (restart_needed_) restart(ledger);
      if (!take_step(horizon)) {
        if (!goes_on_) sample(reached_ = std::min(time_, stop), q, v, ledger);
        return false;
      }
    }
    sample(stop, q, v, ledger);
    return true;
  }

  double step() const { return h_; }           // s
  double reached() const { return reached_; }  // of a run that was ended: time of its state, s
  long worst_coordinate() const { return flow_.worst_coordinate(newton_.correction(), norm_, h_); }

  std::vector<double> memory() const { return {}; }  // a run that goes on starts anew, at order 1

  std::map<std::string, double> counters() const {
    std::map<std::string, double> all{
            {"steps", double(steps_)},
            {"rejected", double(rejected_)},
            {"newton_failures", double(failed_)},
            {"newton_iterations", double(newton_.iterations())},
            {"jacobians", double(newton_.factorisations())},
            {"factorisations", double(newton_.factorisations())},
            {"events", double(events_)},
            {"restarts", double(restarts_)},
            {"order_mean", steps_ > 0 ? double(orders_) / double(steps_) : 0.0},
            {"error_most", error_most_},
            {"error_sum", error_sum_}};
    if (observer_.looks_at_error()) carried_.add_counters(all);
    return all;
  }

 private:
  using Newton = NdfNewton<PlantT>;
  static constexpr double kToleranceShare = 1.0 / 6.0;  // of the accuracy that one step may lose
  static constexpr double kHardDriveShare = 0.03;  // of that, with hard drives
  static constexpr double kPrescribedShare = 0.3;  // of that, where joints follow a motion
  static constexpr double kLeastVelocityWeight = 0.03;  // s, of velocity errors
  static constexpr double kHardVelocityWeight = 0.3;  // s, where a joint is at its torque limit or slides
  // Tolerances that an error of order 1 or 2 counts for after a switch of the drives: there may be
  // hundreds of them a second, each with a start at low order.
  static constexpr double kRestartStrictness = 8.0;
  static constexpr double kTouchTolerances = 10.0;  // a foot has landed within a hundredth of a tolerance
  static constexpr double kLocatedTolerances = 10.0;  // by which Newton's last correction may move a foot
  static constexpr double kLeastStep = 1e-14;      // s, and of the time
  static constexpr double kJumpStep = 1e-13;       // s, and of the time; across the jump of a damper's force at
                                                   // touch-down no step is accurate, and so short a one will do
  static constexpr double kMaxTurn = 0.5;          // rad, of the chart
  static constexpr double kMaxGrowth = 10.0;       // of the step size
  static constexpr double kLimitGrowth = 1.2;      // of the step limit, per step after a failure
  static constexpr int kMaxTries = 100, kMaxEventTries = 4, kMaxSwitchTries = 8;
  static constexpr double kLeastEventStep = 1e-11;  // s, and of the time

  static double scene_share(const PlantT& plant, const Reference& reference) {
    if (PlantT::kPrescribed) return kPrescribedShare;
    return DriveEvents<PlantT>::hard(plant, reference) ? kHardDriveShare : 1.0;
  }

  void begin(double t, const VectorXd& q, const VectorXd& v) {
    flow_.begin(q, v, y_);
    booked_works_ = flow_.w(y_);
    time_ = t;
  }

  // A new history from the last point, in a chart of its own.
  void restart(EnergyLedger& ledger) {
    if (!history_.empty()) {
      y_ = history_.last();
      book_works(ledger);
      if (observer_.looks_at_error()) carried_.move_chart(flow_, y_);
      flow_.state(time_, y_, q_, v_);
      flow_.plant.stop_turned_back(v_);
      flow_.begin(q_, v_, y_);
      booked_works_.setZero();
    }
    flow_.evaluate(time_, y_);
    strictness_ = drives_.changed() ? kRestartStrictness : 1.0;
    drives_.start(flow_.plant, flow_.reference, time_, flow_.position(), flow_.velocity());
    flow_.rate_here(time_, y_, rate_);
    touch_.begin(flow_.plant);
    const double most = strictness_ * std::max(1e-3, flow_.v(rate_).cwiseAbs().maxCoeff());
    h_ = 0.5 * std::sqrt(tolerance_ / most);
    history_.restart(y_, rate_, h_);
    step_limit_ = std::numeric_limits<double>::infinity();
    newton_.forget_contraction();
    equal_steps_ = 0;
    restart_needed_ = false;
    ++restarts_;
    carried_.happened(time_);
  }

  // Accepts one step; false if none can be found.
  bool take_step(double horizon) {
    drives_.weigh(flow_.plant, kLeastVelocityWeight, kHardVelocityWeight, norm_);
    const double longest = std::min(step_limit_, touch_.longest_step(flow_.plant));
    if (h_ > longest) resize(longest);
    int located = 0, switched = 0;
    for (int tries = 0; tries < kMaxTries; ++tries) {
      const double rest = horizon - time_, h = fit_step(h_, rest);
      if (h != h_) resize(h);
      if (!(h > kLeastStep * std::max(1.0, std::abs(time_)) || h == rest)) return false;
      const double end = h == rest ? horizon : time_ + h;
      const double least = kLeastEventStep * std::max(1.0, std::abs(time_));
      const TouchDownLocator* touch = located < kMaxEventTries && h > least ? &touch_ : nullptr;
      const typename Newton::NewtonOutcome outcome = newton_.solve(end, h_, history_, touch, y_);
      if (outcome == Newton::NewtonOutcome::touched_down) {
        ++located;
        resize(std::max(least, h * newton_.touch_share()));
      } else if (outcome == Newton::NewtonOutcome::failed) {
        ++failed_;
        resize(0.5 * h);
        step_limit_ = kLimitGrowth * h_;
        newton_.forget_contraction();
      } else {
        const double strictness = history_.order() < 3 ? strictness_ : 1.0;
        const double size = strictness * error_of(history_.order(), newton_.correction());
        const bool jump = size > 1.0 && h <= kJumpStep * std::max(1.0, std::abs(time_));
        if (size <= 1.0 || jump) {
          if (flow_.plant.dry) flow_.evaluate(end, y_);
          look_inside(end, h);
          const double share = drives_.share(end, y_, h);
          if (share < 1.0 && switched < kMaxSwitchTries && h > least) {
            ++switched;
            resize(h * share);
            continue;
          }
          accept(end, size, located > 0 || jump, end == horizon);
          return goes_on_ && flow_.velocity().cwiseAbs().maxCoeff() < kDivergedSpeed;
        }
        ++rejected_;
        const double power = std::pow(size, -1.0 / (history_.order() + 1));
        resize(h * std::max(0.2, newton_.safety() * power));
      }
    }
    return false;
  }

  // Shows the drives the middle of the step that ends there.
  void look_inside(double end, double h) {
    drives_.begin(end - h);
    if (drives_.idle()) return;
    history_.at_with(newton_.correction(), -0.5, middle_);
    drives_.passed(end - 0.5 * h, middle_);
  }

  double error_of(int order, const VectorXd& d) const {
    return BackwardDifferences::error_constant(order) * flow_.norm_of(d, norm_, h_);
  }

  // Whether a foot is on its way into the ground and may be there after the correction that is not evaluated.
  bool may_land() const {
    const PlantT& plant = flow_.plant;
    if (!plant.law.normal.needs_touch_speed()) return false;
    return std::any_of(plant.feet.begin(), plant.feet.end(), [&](const auto& foot) {
      return !foot.active && foot.ground.gap < plant.located_depth && foot.ground.normal.dot(foot.velocity) < 0.0;
    });
  }

  void accept(double t, double size, bool located, bool last) {
    if (may_land()) flow_.evaluate(t, y_);
    const double local = BackwardDifferences::error_constant(history_.order()) *
                         flow_.xi(newton_.correction()).cwiseAbs().maxCoeff();
    error_most_ = std::max(error_most_, local);
    error_sum_ += local;
    if (observer_.looks_at_error()) carry_error(t);
    history_.accept(newton_.correction());
    flow_.state(t, y_, q_, v_);
    goes_on_ = observer_.accepted(t, q_, v_);
    touch_.begin(flow_.plant);
    drives_.count(flow_.plant, h_);
    drives_.move_on();
    time_ = t;
    step_limit_ *= kLimitGrowth;
    ++steps_, ++equal_steps_;
    orders_ += history_.order();
    events_ += located || drives_.changed();
    memories_updated_ = false;
    restart_needed_ = located || last || drives_.changed() || flow_.xi(y_).template segment<3>(3).norm() > kMaxTurn;
    if (!restart_needed_ && equal_steps_ > history_.order()) choose_order_and_step(size);
  }

  // Carries the error over the step that ends at t in y_, and shows where it leads.
  void carry_error(double t) {
    local_ = BackwardDifferences::error_constant(history_.order()) * newton_.correction();
    carried_.add(flow_, y_, local_, h_);
    carried_.show_step(flow_, t, y_);
  }

  // By the errors of this order and its neighbours, as in SciPy's BDF.
  void choose_order_and_step(double size) {
    const int order = history_.order();
    int best = order;
    double most = 0.0;
    const auto offer = [&](int k, double error) {
      const double factor = error > 0.0 ? std::pow(error, -1.0 / (k + 1)) : kMaxGrowth;
      if (factor > most) most = factor, best = k;
    };
    offer(order, size);
    if (order > 1) offer(order - 1, error_of(order - 1, history_.of(order)));
    if (order < BackwardDifferences::kMaxOrder)
      offer(order + 1, error_of(order + 1, history_.of(order + 2)));
    history_.set_order(best);
    resize(h_ * std::min(kMaxGrowth, newton_.safety() * most));
  }

  void resize(double h) {
    history_.rescale(h / h_);
    h_ = h;
    equal_steps_ = 0;
  }

  // Updates what contacts remember at an accepted point; those that separate lose their bristle.
  void update_memories() {
    PlantT& plant = flow_.plant;
    y_ = history_.last();
    std::size_t sliding = 0, slid = 0;
    for (const auto& foot : plant.feet) slid += foot.memory.sliding;
    flow_.update_bristles(y_);
    plant.update_memories();
    for (int i = 0; i < flow_.nz / 3; ++i) {
      sliding += plant.feet[i].memory.sliding;
      if (!plant.feet[i].active) history_.clear_rows(2 * flow_.nv + 3 * i, 3);
    }
    restart_needed_ = restart_needed_ || sliding != slid;
    memories_updated_ = true;
  }

  // The state at `stop`, not beyond the last point; what the next step needs is saved.
  void sample(double stop, VectorXd& q, VectorXd& v, EnergyLedger& ledger) {
    interpolated_ = stop < time_;
    if (interpolated_) {
      flow_.save_evaluation();
      history_.at((stop - time_) / h_, y_);
    } else {
      y_ = history_.last();
    }
    if (observer_.looks_at_error()) carried_.show_sample(flow_, stop, y_);
    flow_.evaluate(stop, y_);
    q = flow_.position();
    v = flow_.velocity();
    book_works(ledger);
    if (!interpolated_) update_memories();
  }

  void book_works(EnergyLedger& ledger) {  // those since the last booking, up to y_
    ledger.add((flow_.w(y_) - booked_works_).eval());
    booked_works_ = flow_.w(y_);
  }

  ChartFlow<PlantT> flow_;
  StepObserver& observer_;
  double tolerance_;  // of one step, m and rad
  ErrorNorm norm_;
  Newton newton_;
  DriveEvents<PlantT> drives_;
  TouchDownLocator touch_;
  CarriedError<PlantT> carried_;
  BackwardDifferences history_;
  VectorXd local_;
  VectorXd y_, middle_, rate_, booked_works_, q_, v_;
  double time_ = 0.0, h_ = 0.0, step_limit_ = 0.0, reached_ = 0.0;  // s
  double strictness_ = 1.0;  // -, of orders 1 and 2
  int equal_steps_ = 0;                             // of this size and order
  bool restart_needed_ = true, memories_updated_ = true, goes_on_ = true;
  bool interpolated_ = false;  // the plant is evaluated at a sample, its last step's end is saved
  long steps_ = 0, rejected_ = 0, failed_ = 0, events_ = 0, restarts_ = 0, orders_ = 0;
  double error_most_ = 0.0, error_sum_ = 0.0;  // m and rad
};

}  // namespace hexapod
