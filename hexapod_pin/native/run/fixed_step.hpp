// A run on the fixed grid k h, sampled every `stride` steps, stopped at the first state that is not
// finite or faster than any robot.
#pragma once

#include "run/sampled_rollout.hpp"

namespace hexapod {

template <class PlantT, class Integrator>
class FixedStepRollout final : public SampledRollout<PlantT> {
  using Base = SampledRollout<PlantT>;

 public:
  FixedStepRollout(PlantT plant, const RunSetup& setup)
      : Base(std::move(plant), setup, Integrator::kNeedsSeparatedFeet), integrator_(plant_),
        h_(setup.step), stride_(setup.stride), step_index_(setup.start.first * setup.stride) {
    evaluate();
    this->sample(time(), 0.0);
  }

  bool advance(long samples) override {
    for (long k = 0; k < samples * stride_; ++k) {
      reference_.begin_step(time());
      integrator_.step(plant_, reference_, time(), h_, q_, v_, ledger_);
      ++step_index_;
      ++steps_;
      const double speed = v_.cwiseAbs().maxCoeff();
      if (!(speed < kDivergedSpeed) || !q_.allFinite()) return false;
      evaluate();
      if (step_index_ % stride_ == 0) this->sample(time(), h_ * double(stride_));
    }
    return true;
  }

  Checkpoint checkpoint() const override {
    return this->checkpoint_at(step_index_ / stride_, {});
  }

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
  using Base::v_;

  double time() const { return double(step_index_) * h_; }

  void evaluate() {
    plant_.evaluate(time(), q_, v_, Integrator::kForcesAtStepEnd ? h_ : 0.0);
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
    return std::make_unique<FixedStepRollout<PlantT, Integrator<PlantT>>>(std::move(plant), setup);
  });
}

}  // namespace hexapod
