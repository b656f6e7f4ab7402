// A run on the fixed grid k h, sampled every `stride` steps, stopped at the first state that is not
// finite or faster than any robot. What happens between two points of the grid splits the step there.
#pragma once

#include "run/sampled_rollout.hpp"

namespace hexapod {

template <class PlantT, class Integrator>
class FixedStepRollout final : public SampledRollout<PlantT> {
  using Base = SampledRollout<PlantT>;

 public:
  FixedStepRollout(PlantT plant, const RunSetup& setup)
      : Base(std::move(plant), setup, Integrator::kNeedsSeparatedFeet), integrator_(plant_),
        h_(setup.step), stride_(setup.stride), step_index_(first_step(setup)) {
    evaluate(h_);
    this->record_start(setup.start);
  }

  bool advance(long samples) override {
    return advance_to(double((sample_index_ + samples) * stride_) * h_);
  }

  bool advance_to(double until) override {
    while (time_ < until && !same_time(time_, until)) {
      const double begin = time_, grid = double(step_index_ + 1) * h_;
      const double event = this->horizon(until);
      const bool whole = event > grid || same_time(event, grid);
      const double end = whole ? grid : event;
      if (!step(begin, whole && begin == double(step_index_) * h_ ? h_ : end - begin)) return false;
      time_ = end;
      if (this->loads_change(begin)) this->begin_loads();
      evaluate(h_);
      const bool goes_on = this->accepted(time_, q_, v_);
      if (whole && ++step_index_ % stride_ == 0) this->arrive_at_sample(time_);
      if (!goes_on) return false;
    }
    return true;
  }

  Checkpoint checkpoint() const override { return this->checkpoint_now({}); }

  Trouble trouble() const override { return {h_, -1, this->loaded_foot()}; }

  std::map<std::string, double> counters() const override {
    std::map<std::string, double> all = integrator_.counters();
    all["steps"] = double(steps_);
    all["evaluations"] = double(plant_.evaluations);
    return all;
  }

 private:
  using Base::ledger_;
  using Base::plant_;
  using Base::q_;
  using Base::reference_;
  using Base::sample_index_;
  using Base::time_;
  using Base::v_;

  // of the step that the start lies in, or that begins there
  static long first_step(const RunSetup& setup) {
    long k = setup.start.first * setup.stride;
    while (double(k + 1) * setup.step < setup.start.time ||
           same_time(double(k + 1) * setup.step, setup.start.time))
      ++k;
    return k;
  }

  bool step(double t, double h) {
    if (h != h_ && Integrator::kForcesAtStepEnd) plant_.set_implicit_dt(q_, h);
    reference_.begin_step(t);
    integrator_.step(plant_, reference_, t, h, q_, v_, ledger_);
    ++steps_;
    const double speed = v_.cwiseAbs().maxCoeff();
    return speed < kDivergedSpeed && q_.allFinite();
  }

  void evaluate(double h) {
    plant_.evaluate(time_, q_, v_, Integrator::kForcesAtStepEnd ? h : 0.0);
    plant_.update_memories();
  }

  Integrator integrator_;
  double h_;
  long stride_, step_index_, steps_ = 0;
};

template <template <class> class Integrator>
std::unique_ptr<Rollout> start_fixed_step(const RunSetup& setup) {
  return setup.plant.with_plant([&](auto plant) -> std::unique_ptr<Rollout> {
    using PlantT = decltype(plant);
    return start_run_of<FixedStepRollout<PlantT, Integrator<PlantT>>>(std::move(plant), setup);
  });
}

}  // namespace hexapod
