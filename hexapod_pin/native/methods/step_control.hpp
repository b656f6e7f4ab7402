// The length of the next step of a one-step method. The driver decides whether a step is accepted
// (OneStepDriver::step_from); the length follows from the errors of the last ones: the predictive
// controller of Gustafsson (1994), and after a jump of the set-points the length that served after the
// jump before.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "methods/error_control.hpp"

namespace hexapod {

class StepControl {
 public:
  static constexpr int kMemorySize = 5;

  double step() const { return step_; }  // s

  // The set-points have jumped: what the errors did before says nothing.
  void jump() {
    jumped_ = true;
    last_size_ = 0.0;
    if (step_after_jump_ > 0.0) step_ = std::min(step_, step_after_jump_);
  }

  // A step of h was given up for an error of `size` tolerances; returns the length of the next try.
  double after_rejection(double h, double size, int order) {
    return step_ = next_step(h, size, order, false);
  }

  // A step was given up for another reason; so is the length of the next try.
  void shorten(double h) { step_ = h; }

  // The next step is to be no longer.
  void bound(double h) { step_ = std::min(step_, h); }

  // A step of h was accepted. `cut`: it was shorter than it could have been; `located`: it ended at an event.
  void after_acceptance(double h, double size, int order, bool cut, bool located) {
    if (!located) {
      const double next = std::min(kMostGrowth * h, trend(h, size, order) * next_step(h, size, order, true));
      step_ = cut ? std::max(step_, next) : next;
    }
    last_size_ = located ? 0.0 : size;
    last_step_ = h;
    last_order_ = order;
    if (jumped_) step_after_jump_ = step_;
    jumped_ = false;
  }

  // For a checkpoint.
  std::vector<double> memory() const {
    return {step_, step_after_jump_, last_size_, last_step_, double(last_order_)};
  }
  void restore(const double* memory) {
    step_ = memory[0], step_after_jump_ = memory[1], last_size_ = memory[2], last_step_ = memory[3];
    last_order_ = int(memory[4]);
  }

 private:
  static constexpr double kFirstStep = 1e-4;   // s
  static constexpr double kMostGrowth = 5.0;   // from step to step
  static constexpr double kMostRise = 1.3, kMostFall = 2.0;  // -; a larger rise costs more tries than it saves

  // How the error constant changes from step to step.
  double trend(double h, double size, int order) const {
    if (!(last_size_ > 0.0 && size > 0.0 && order == last_order_)) return 1.0;
    const double change = h / last_step_ * std::pow(last_size_ / size, 1.0 / order);
    return std::clamp(change, 1.0 / kMostFall, kMostRise);
  }

  double step_ = kFirstStep, step_after_jump_ = 0.0;  // s; the latter 0 before the first jump
  double last_size_ = 0.0, last_step_ = 0.0;  // of the last step, tolerances and s
  int last_order_ = 0;
  bool jumped_ = false;  // since the last step
};

}  // namespace hexapod
