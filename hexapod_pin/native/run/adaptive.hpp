// A run whose steps follow the error: it stops at every sample and at every jump of the set-points.
#pragma once

#include <algorithm>

#include "run/sampled_rollout.hpp"

namespace hexapod {

template <class PlantT, class Driver>
class AdaptiveRollout final : public SampledRollout<PlantT> {
  using Base = SampledRollout<PlantT>;

 public:
  AdaptiveRollout(PlantT plant, const RunSetup& setup)
      : Base(std::move(plant), setup, true),  // touch-downs are found before they happen
        driver_(plant_, reference_, setup.accuracy, setup.start.controller),
        interval_(setup.sample), sample_index_(setup.start.first) {
    plant_.evaluate(time(), q_, v_, 0.0);
    plant_.update_memories();
    this->sample(time(), 0.0);
  }

  bool advance(long samples) override {
    for (long k = 0; k < samples; ++k) {
      double t = time();
      ++sample_index_;
      while (t < time()) {
        const double jump = reference_.next_jump(t), stop = std::min(time(), jump);
        reference_.begin_step(t);
        if (!driver_.advance(t, stop, jump, q_, v_, ledger_)) return false;
        t = stop;
      }
      this->sample(time(), interval_);
    }
    return true;
  }

  Checkpoint checkpoint() const override {
    return this->checkpoint_at(sample_index_, driver_.memory());
  }

  std::map<std::string, double> counters() const override {
    std::map<std::string, double> all = driver_.counters();
    all["evaluations"] = double(plant_.evaluations);
    return all;
  }

 private:
  using Base::ledger_;
  using Base::plant_;
  using Base::q_;
  using Base::reference_;
  using Base::v_;

  double time() const { return double(sample_index_) * interval_; }

  Driver driver_;
  double interval_;
  long sample_index_;
};

template <template <class> class Driver>
std::unique_ptr<Rollout> start_adaptive(const RunSetup& setup) {
  return setup.plant.with_plant([&](auto plant) -> std::unique_ptr<Rollout> {
    using PlantT = decltype(plant);
    return std::make_unique<AdaptiveRollout<PlantT, Driver<PlantT>>>(std::move(plant), setup);
  });
}

}  // namespace hexapod
