// Simplified Newton for one step of a numerical differentiation formula, with the stiff block as its
// matrix. The contraction found in earlier steps is trusted for a while, so that most steps need one
// iteration.
#pragma once

#include <algorithm>
#include <cmath>

#include "methods/backward_differences.hpp"
#include "methods/error_control.hpp"
#include "methods/chart_flow.hpp"
#include "methods/stiff_block.hpp"
#include "methods/touch_down_locator.hpp"

namespace hexapod {

template <class PlantT>
class NdfNewton {
 public:
  enum class NewtonOutcome { converged, failed, touched_down };

  NdfNewton(ChartFlow<PlantT>& flow, const ErrorNorm& norm)
      : flow_(flow), norm_(norm), block_(flow.plant), power_(flow.plant.feet.size()),
        demand_(flow.plant.joints()) {}

  // Solves c f(t, y) - psi - d = 0 for y = predicted + d, a step `h` [s] that ends at t. Stops where a
  // foot touches down before the end, if `touch` is given.
  NewtonOutcome solve(double t, double h, const BackwardDifferences& history, const TouchDownLocator* touch,
                VectorXd& y) {
    const double c = h / BackwardDifferences::alpha(history.order());
    history.predict(y);
    history.psi(psi_);
    correction_.setZero(y.size());
    double before = 0.0, rate = since_measured_ < kTrustedSteps ? contraction_ : kUnknown;
    bool stale = true;
    for (int k = 1; k <= kMaxIterations; ++k) {
      flow_.rate(t, y, change_);
      ++iterations_;
      if (!change_.allFinite()) return NewtonOutcome::failed;
      if (touch != nullptr && (touch_share_ = touch->share(flow_.plant, h)) < 1.0)
        return NewtonOutcome::touched_down;
      if (!refresh(t, c, stale, y) && k > 1) before = 0.0, rate = kUnknown;
      change_ = c * change_ - psi_ - correction_;
      block_.solve(flow_.xi(change_), flow_.v(change_), flow_.z(change_));
      find_works(c);
      y += change_;
      correction_ += change_;
      const double size = flow_.norm_of(change_, norm_, h);
      if (!std::isfinite(size)) return NewtonOutcome::failed;
      if (before > 0.0) {
        rate = std::max(0.3 * contraction_, size / before);
        since_measured_ = 0;
        const double left = std::pow(rate, kMaxIterations - k) / (1.0 - rate) * size;
        if (rate >= 1.0 || left > kTolerance) return NewtonOutcome::failed;
      }
      if (size == 0.0 || (rate >= 0.0 && rate / (1.0 - rate) * size < kTolerance)) {
        contraction_ = rate;
        ++since_measured_;
        used_ = k;
        return NewtonOutcome::converged;
      }
      stale = rate > kSlowContraction;
      before = size;
    }
    return NewtonOutcome::failed;
  }

  void forget_contraction() { contraction_ = kUnknown; }

  const VectorXd& correction() const { return correction_; }  // d of the last solve
  double touch_share() const { return touch_share_; }         // of the step, at the touch-down found

  // Factor on the next step size [-], less after more iterations (as in SciPy's BDF).
  double safety() const {
    if (used_ == 0) return kSafety;
    return kSafety * (2.0 * kMaxIterations + 1.0) / (2.0 * kMaxIterations + used_);
  }

  long iterations() const { return iterations_; }
  long factorisations() const { return factorisations_; }

 private:
  static constexpr int kMaxIterations = 4;
  static constexpr int kTrustedSteps = 40;           // without a new measure of the contraction
  static constexpr double kTolerance = 0.03;         // of Newton's error, in tolerances of the step
  static constexpr double kSlowContraction = 0.1;    // -; above it the block is captured again
  static constexpr double kSafety = 0.8;             // -
  static constexpr double kUnknown = -1.0;

  // The works' part of a correction, from the powers where it leads to.
  void find_works(double c) {
    power_.clear();
    if constexpr (PlantT::kPrescribed) {
      acceleration_ = (flow_.v(psi_) + flow_.v(correction_) + flow_.v(change_)) / c;
      acceleration_.tail(demand_.size()) = flow_.joint_acceleration();
    }
    block_.accumulate_power(flow_.plant, flow_.velocity(), demand_, acceleration_, flow_.z(change_),
                            power_);
    power_.write(flow_.w(change_));
    flow_.w(change_) = c * flow_.w(change_) - flow_.w(psi_) - flow_.w(correction_);
  }

  // Captures and factors the block of the state just evaluated where it is stale or does not fit;
  // false in the latter case.
  bool refresh(double t, double c, bool stale, const VectorXd& y) {
    if constexpr (!PlantT::kPrescribed) flow_.servo_demand(t, demand_);
    const bool fits = stale || block_.fits(flow_.plant);
    if (fits && !stale) return true;
    block_.capture(flow_.plant, flow_.xi(y));
    block_.factor(flow_.plant, c);
    ++factorisations_;
    return fits;
  }

  ChartFlow<PlantT>& flow_;
  ErrorNorm norm_;
  StiffBlock<PlantT> block_;
  EnergyLedger power_;
  VectorXd psi_, change_, correction_, demand_, acceleration_;
  double contraction_ = kUnknown;  // of the corrections, -
  int since_measured_ = 0;         // steps since the contraction was measured
  int used_ = 0;                   // iterations of the last converged solve
  double touch_share_ = 1.0;
  long iterations_ = 0, factorisations_ = 0;
};

}  // namespace hexapod
