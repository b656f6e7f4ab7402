// Numerical differentiation formulas of order 1 to 5 (Shampine & Reichelt, 1997): quasi-constant steps
// that pass over samples, simplified Newton with the stiff block, a new history where the right-hand
// side jumps or bends: at jumps of the set-points and at touch-downs.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "methods/differences.hpp"
#include "methods/error_control.hpp"
#include "methods/flow.hpp"
#include "methods/stiff_block.hpp"
#include "methods/touch_down.hpp"
#include "run/rollout.hpp"

namespace hexapod {

template <class PlantT>
class NdfDriver {
 public:
  NdfDriver(PlantT& plant, Reference& reference, double tolerance, const std::vector<double>& /*memory*/)
      : flow_(plant, reference), block_(plant), tolerance_(kShare * tolerance),
        norm_{tolerance_, kLeastWeight, plant.law.friction.steepness()},
        touch_(plant.feet.size(), kLanding * tolerance_), powers_(plant.feet.size()),
        wanted_(plant.joints()), q_ref_(plant.joints()), v_ref_(plant.joints()) {}

  // From t to `stop`, in steps that may end beyond it but not beyond `horizon`, the set-points' next
  // jump. The plant is evaluated at (t, q, v) before and at `stop` after. False: no step of a
  // sensible size is good enough.
  bool advance(double t, double stop, double horizon, VectorXd& q, VectorXd& v, EnergyLedger& ledger) {
    if (aside_) flow_.plant.recall();
    aside_ = false;
    if (history_.empty()) begin(t, q, v);
    while (time_ < stop) {
      if (!settled_) settle();
      if (fresh_) restart(ledger);
      if (!step_on(horizon)) return false;
    }
    sample(stop, q, v, ledger);
    return true;
  }

  std::vector<double> memory() const { return {}; }  // a run that goes on starts anew, at order 1

  std::map<std::string, double> counters() const {
    return {{"steps", double(steps_)},
            {"rejected", double(rejected_)},
            {"newton_failures", double(failed_)},
            {"newton_iterations", double(iterations_)},
            {"jacobians", double(jacobians_)},
            {"factorisations", double(jacobians_)},
            {"events", double(events_)},
            {"restarts", double(restarts_)},
            {"order_mean", steps_ > 0 ? double(orders_) / double(steps_) : 0.0},
            {"error_most", error_most_},
            {"error_sum", error_sum_},
            {"error_estimate", std::sqrt(error_most_ * error_sum_)}};
  }

 private:
  enum class Newton { converged, failed, touches };
  static constexpr double kShare = 1.0 / 6.0;   // of the accuracy that one step may lose
  static constexpr double kLeastWeight = 0.03;  // s, of velocity errors
  static constexpr double kLanding = 1e4;  // a foot has landed within 10 tolerances of the ground
  static constexpr double kLeastStep = 1e-14;  // s
  static constexpr double kMostTurn = 0.5;     // rad, of the chart
  static constexpr double kKappa = 0.03;       // Newton's error over the step's
  static constexpr double kSlow = 0.1;         // contraction at which the block is captured again
  static constexpr double kSafety = 0.8;
  static constexpr double kUnknown = -1.0;
  static constexpr int kMostTries = 100, kMostEventTries = 4, kMostIterations = 4, kTrusted = 40;

  void begin(double t, const VectorXd& q, const VectorXd& v) {
    flow_.begin(q, v, y_);
    booked_ = flow_.w(y_);
    time_ = t;
  }

  // A new history from the last point, in a chart of its own.
  void restart(EnergyLedger& ledger) {
    if (!history_.empty()) {
      y_ = history_.last();
      book(ledger);
      flow_.configuration(y_, q_);
      v_ = flow_.v(y_);
      flow_.begin(q_, v_, y_);
      booked_.setZero();
    }
    flow_.rate(time_, y_, rate_);
    touch_.begin(flow_.plant);
    h_ = 0.5 * std::sqrt(tolerance_ / std::max(1e-3, flow_.v(rate_).cwiseAbs().maxCoeff()));
    history_.restart(y_, rate_, h_);
    limit_ = std::numeric_limits<double>::infinity();
    contraction_ = kUnknown;
    equal_ = 0;
    fresh_ = false;
    ++restarts_;
  }

  // Accepts one step; false if none can be found.
  bool step_on(double horizon) {
    if (h_ > limit_) resize(limit_);
    int located = 0;
    for (int tries = 0; tries < kMostTries; ++tries) {
      const double rest = horizon - time_, h = fit_step(h_, rest);
      if (h != h_) resize(h);
      if (!(h > kLeastStep * std::max(1.0, std::abs(time_)) || h == rest)) return false;
      const double end = h == rest ? horizon : time_ + h;
      const Newton outcome = iterate(end, located < kMostEventTries);
      if (outcome == Newton::touches) {
        ++located;
        resize(h * share_);
      } else if (outcome == Newton::failed) {
        ++failed_;
        resize(0.5 * h);
        limit_ = 1.2 * h_;
        contraction_ = kUnknown;
      } else {
        const double size = error_of(history_.order(), correction_);
        if (size <= 1.0) {
          accept(end, size, located > 0, end == horizon);
          return flow_.velocity().cwiseAbs().maxCoeff() < kMostSpeed;
        }
        ++rejected_;
        resize(h * std::max(0.2, safety_ * std::pow(size, -1.0 / (history_.order() + 1))));
      }
    }
    return false;
  }

  // Solves c f(t, y) - psi - d = 0 for y = predicted + d. The contraction found in the last steps is
  // trusted for a while, so that most steps need one iteration.
  Newton iterate(double t, bool watch) {
    const double c = h_ / Differences::alpha(history_.order());
    history_.predict(y_);
    history_.psi(psi_);
    correction_.setZero(y_.size());
    double before = 0.0, rate = unmeasured_ < kTrusted ? contraction_ : kUnknown;
    bool stale = true;
    for (int k = 1; k <= kMostIterations; ++k) {
      flow_.rate(t, y_, rate_);
      ++iterations_;
      if (!rate_.allFinite()) return Newton::failed;
      if (watch && (share_ = touch_.share(flow_.plant, h_)) < 1.0) return Newton::touches;
      if (!refresh(t, c, stale) && k > 1) before = 0.0, rate = kUnknown;
      rate_ = c * rate_ - psi_ - correction_;
      block_.solve(flow_.xi(rate_), flow_.v(rate_), flow_.z(rate_));
      find_works(c);
      y_ += rate_;
      correction_ += rate_;
      const double size = norm_(flow_.xi(rate_), flow_.v(rate_), flow_.z(rate_), h_);
      if (!std::isfinite(size)) return Newton::failed;
      if (before > 0.0) {
        rate = std::max(0.3 * contraction_, size / before);
        unmeasured_ = 0;
        const double left = std::pow(rate, kMostIterations - k) / (1.0 - rate) * size;
        if (rate >= 1.0 || left > kKappa) return Newton::failed;
      }
      if (size == 0.0 || (rate >= 0.0 && rate / (1.0 - rate) * size < kKappa)) {
        contraction_ = rate;
        ++unmeasured_;
        safety_ = kSafety * (2.0 * kMostIterations + 1.0) / (2.0 * kMostIterations + k);
        return Newton::converged;
      }
      stale = rate > kSlow;
      before = size;
    }
    return Newton::failed;
  }

  // The works' part of a correction, from the powers where it leads to.
  void find_works(double c) {
    powers_.clear();
    block_.add_power(flow_.plant, flow_.velocity(), wanted_, flow_.z(rate_), powers_);
    powers_.write(flow_.w(rate_));
    flow_.w(rate_) = c * flow_.w(rate_) - flow_.w(psi_) - flow_.w(correction_);
  }

  // Captures and factors the block of the state just evaluated where it is stale or does not fit;
  // false in the latter case.
  bool refresh(double t, double c, bool stale) {
    flow_.reference.at(t, q_ref_, v_ref_);
    const Servo& servo = flow_.plant.servo;
    wanted_ = servo.kp.cwiseProduct(q_ref_ - flow_.joints()) +
              servo.kd.cwiseProduct(v_ref_ - flow_.velocity().tail(flow_.plant.joints()));
    const bool fits = stale || block_.fits(flow_.plant, wanted_);
    if (fits && !stale) return true;
    block_.capture(flow_.plant, flow_.xi(y_), wanted_);
    block_.factor(flow_.plant, c);
    ++jacobians_;
    return fits;
  }

  double error_of(int order, const VectorXd& d) const {
    return Differences::error_constant(order) * norm_(flow_.xi(d), flow_.v(d), flow_.z(d), h_);
  }

  void accept(double t, double size, bool located, bool last) {
    const double local = Differences::error_constant(history_.order()) *
                         flow_.xi(correction_).cwiseAbs().maxCoeff();
    error_most_ = std::max(error_most_, local);
    error_sum_ += local;
    history_.accept(correction_);
    touch_.begin(flow_.plant);
    time_ = t;
    limit_ *= 1.2;
    ++steps_, ++equal_;
    orders_ += history_.order();
    events_ += located;
    located_ = located;
    settled_ = false;
    fresh_ = located || last || flow_.xi(y_).template segment<3>(3).norm() > kMostTurn;
    if (!fresh_ && equal_ > history_.order()) choose(size);
  }

  // Order and step by the errors of this order and its neighbours, as in SciPy's BDF.
  void choose(double size) {
    const int order = history_.order();
    int best = order;
    double most = 0.0;
    const auto offer = [&](int k, double error) {
      const double factor = error > 0.0 ? std::pow(error, -1.0 / (k + 1)) : kMostGrowth;
      if (factor > most) most = factor, best = k;
    };
    offer(order, size);
    if (order > 1) offer(order - 1, error_of(order - 1, history_.of(order)));
    if (order < Differences::kMostOrder)
      offer(order + 1, error_of(order + 1, history_.of(order + 2)));
    history_.set_order(best);
    resize(h_ * std::min(kMostGrowth, safety_ * most));
  }

  void resize(double h) {
    history_.rescale(h / h_);
    h_ = h;
    equal_ = 0;
  }

  // Contacts remember what they do at an accepted point; those that let go lose their bristle.
  void settle() {
    PlantT& plant = flow_.plant;
    const FrictionLaw& law = plant.law.friction;
    y_ = history_.last();
    std::size_t sliding = 0, slid = 0;
    for (auto& foot : plant.feet) {
      slid += foot.memory.sliding;
      if (located_ && foot.active && !foot.memory.touching)
        foot.memory.touch_speed = std::max(0.0, -foot.ground.normal.dot(foot.velocity));
    }
    flow_.settle_bristles(y_);
    plant.settle_memory();
    for (int i = 0; i < flow_.nz / 3; ++i) {
      sliding += plant.feet[i].memory.sliding;
      if (!plant.feet[i].active) history_.clear_rows(2 * flow_.nv + 3 * i, 3);
    }
    fresh_ = fresh_ || (sliding != slid && law.mu != law.mu_dynamic);
    settled_ = true;
  }

  // The state at `stop`, not beyond the last point; what the next step needs is kept aside.
  void sample(double stop, VectorXd& q, VectorXd& v, EnergyLedger& ledger) {
    aside_ = stop < time_;
    if (aside_) {
      flow_.keep();
      history_.at((stop - time_) / h_, y_);
    } else {
      y_ = history_.last();
    }
    flow_.evaluate(stop, y_);
    q = flow_.position();
    v = flow_.velocity();
    book(ledger);
    if (!aside_) settle();
  }

  void book(EnergyLedger& ledger) {  // works since the last booking, up to y_
    ledger.add((flow_.w(y_) - booked_).eval());
    booked_ = flow_.w(y_);
  }

  static constexpr double kMostGrowth = 10.0;

  Flow<PlantT> flow_;
  StiffBlock<PlantT> block_;
  double tolerance_;
  ErrorNorm norm_;
  TouchDown touch_;
  Differences history_;
  EnergyLedger powers_;
  VectorXd y_, psi_, rate_, correction_, booked_, q_, v_, wanted_, q_ref_, v_ref_;
  double time_ = 0.0, h_ = 0.0, limit_ = 0.0, share_ = 1.0, safety_ = kSafety;
  double contraction_ = kUnknown;  // of Newton's corrections
  int unmeasured_ = 0;             // steps since it was measured
  int equal_ = 0;                  // steps of this size and order
  bool fresh_ = true, settled_ = true, aside_ = false, located_ = false;
  long steps_ = 0, rejected_ = 0, failed_ = 0, iterations_ = 0, jacobians_ = 0, events_ = 0,
       restarts_ = 0, orders_ = 0;
  double error_most_ = 0.0, error_sum_ = 0.0;
};

}  // namespace hexapod
