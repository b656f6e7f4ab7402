// A run whose steps follow the error: it stops at every sample and at every jump of the set-points; its
// method may have stepped over a sample and know the state there.
#pragma once

#include <limits>

#include "run/sampled_rollout.hpp"

namespace hexapod {

template <class PlantT, class Driver>
class AdaptiveRollout final : public SampledRollout<PlantT> {
  using Base = SampledRollout<PlantT>;

 public:
  AdaptiveRollout(PlantT plant, const RunSetup& setup)
      : Base(std::move(plant), setup, true),  // touch-downs are found before they happen
        driver_(plant_, reference_, setup.resolution, setup.start.controller, *this) {
    evaluate();
    this->record_start(setup.start);
  }

  // Steps may pass over samples, and over the last of these too, but not over the run's end: no command
  // follows.
  bool advance(long samples) override {
    const double end = this->earlier(double(sample_index_ + samples) * interval_);
    return run_to(end, std::max(end, end_));
  }

  // Commands may follow: steps end at samples where the method then takes the same steps, and so reaches the
  // same bits, from a checkpoint at any of them.
  bool advance_to(double until) override { return run_to(until, Driver::kRestarts ? until : time_); }

  Checkpoint checkpoint() const override { return this->checkpoint_now(driver_.memory()); }

  Trouble trouble() const override {
    return {driver_.step(), driver_.worst_coordinate(), this->loaded_foot()};
  }

  std::map<std::string, double> counters() const override {
    std::map<std::string, double> all = driver_.counters();
    all["evaluations"] = double(plant_.evaluations);
    return all;
  }

 private:
  using Base::end_;
  using Base::interval_;
  using Base::ledger_;
  using Base::plant_;
  using Base::q_;
  using Base::reference_;
  using Base::sample_index_;
  using Base::time_;
  using Base::v_;

  bool run_to(double until, double no_step_beyond) {
    while (time_ < until && !same_time(time_, until)) {
      const double begin = time_, stop = this->next_stop(until);
      const double horizon = std::max(stop, this->horizon(no_step_beyond));
      reference_.begin_step(begin);
      if (!driver_.advance(begin, stop, horizon, q_, v_, ledger_)) {
        if (this->ended()) time_ = driver_.reached();
        return false;
      }
      if (stop == this->next_sample()) this->arrive_at_sample(stop);
      else time_ = stop;
      if (this->loads_change(begin)) {
        this->begin_loads();
        evaluate();
      }
    }
    return true;
  }

  void evaluate() {
    plant_.evaluate(time_, q_, v_, 0.0);
    plant_.update_memories();
  }

  Driver driver_;
};

template <template <class> class Driver>
std::unique_ptr<Rollout> start_adaptive(const RunSetup& setup) {
  return setup.plant.with_plant([&](auto plant) -> std::unique_ptr<Rollout> {
    using PlantT = decltype(plant);
    return start_run_of<AdaptiveRollout<PlantT, Driver<PlantT>>>(std::move(plant), setup);
  });
}

}  // namespace hexapod
