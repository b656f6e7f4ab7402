// Ends a run that has used up what it may, whose steps have shrunk to nothing, or that is to stop.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <limits>

namespace hexapod {

// What a run may use; the defaults set no limit.
struct WorkLimits {
  double evaluations = std::numeric_limits<double>::infinity();  // of the right-hand side
  double smallest_step = 0.0;  // s, mean of the steps between two looks
  double wall_time = std::numeric_limits<double>::infinity();  // s, since the first step
};

class WorkMonitor {
 public:
  enum class Verdict { none, evaluations, smallest_step, wall_time, stopped };

  // From time t on [s].
  void start(const WorkLimits& limits, double t) {
    limits_ = limits;
    time_ = t;
  }

  // Asked now and then in the thread that advances the run; false ends it.
  void ask(std::function<bool()> poll) { poll_ = std::move(poll); }

  // Ends the run at its next look; from any thread.
  void stop() { told_to_stop_ = true; }

  // After every accepted step, which has led to t [s]: whether the run goes on.
  bool goes_on(double t, long evaluations) {
    ++steps_;
    return evaluations < next_look_ || look(t, evaluations);
  }

  Verdict verdict() const { return verdict_; }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr long kLook = 20000;  // evaluations between two looks, less than 0.1 s

  bool look(double t, long evaluations) {
    if (next_look_ == 0) begin_ = Clock::now();
    const std::chrono::duration<double> spent = Clock::now() - begin_;
    const double mean = (t - time_) / double(steps_);
    if (told_to_stop_ || (poll_ && !poll_())) verdict_ = Verdict::stopped;
    else if (double(evaluations) >= limits_.evaluations) verdict_ = Verdict::evaluations;
    else if (next_look_ > 0 && mean < limits_.smallest_step) verdict_ = Verdict::smallest_step;
    else if (spent.count() > limits_.wall_time) verdict_ = Verdict::wall_time;
    time_ = t, steps_ = 0;
    next_look_ = long(std::min(double(evaluations + kLook), std::max(limits_.evaluations, 1.0)));
    return verdict_ == Verdict::none;
  }

  WorkLimits limits_;
  std::function<bool()> poll_;
  std::atomic<bool> told_to_stop_{false};
  Verdict verdict_ = Verdict::none;
  Clock::time_point begin_;
  double time_ = 0.0;               // of the last look, s
  long steps_ = 0, next_look_ = 0;  // since then; evaluations
};

}  // namespace hexapod
