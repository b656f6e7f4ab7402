// A run whose steps follow the error: it stops at every sample and at every jump of the set-points.
#pragma once

#include <algorithm>

#include "run/rollout.hpp"

namespace hexapod {

template <class PlantT, class Driver>
class AdaptiveRollout final : public Rollout {
 public:
  AdaptiveRollout(PlantT plant, const RunSetup& setup)
      : plant_(std::move(plant)), reference_(setup.reference),
        driver_(plant_, reference_, setup.accuracy, setup.start.controller), recorder_(plant_),
        q_(setup.start.q), v_(setup.start.v), torque_(plant_.joints()), q_ref_(plant_.joints()),
        v_ref_(plant_.joints()), ledger_(plant_.feet.size()), interval_(setup.sample),
        now_(setup.start.first) {
    plant_.look_ahead = true;  // touch-downs are seen before they happen
    restore_memories(plant_, setup.start.contacts);
    plant_.evaluate(time(), q_, v_, 0.0);
    plant_.settle_memory();
    sample(0.0);
  }

  bool advance(long samples) override {
    for (long k = 0; k < samples; ++k) {
      double t = time();
      ++now_;
      while (t < time()) {
        const double jump = reference_.next_jump(t), stop = std::min(time(), jump);
        reference_.begin_step(t);
        if (!driver_.advance(t, stop, jump, q_, v_, ledger_)) return false;
        t = stop;
      }
      sample(interval_);
    }
    return true;
  }

  const Recorder& record() const override { return recorder_; }

  Checkpoint checkpoint() const override {
    return {now_, q_, v_, contact_memories(plant_), driver_.memory()};
  }

  std::map<std::string, double> counters() const override {
    std::map<std::string, double> all = driver_.counters();
    all["evaluations"] = double(plant_.evaluations);
    return all;
  }

 private:
  double time() const { return double(now_) * interval_; }

  void sample(double interval) {
    reference_.begin_step(time());
    reference_.at(time(), q_ref_, v_ref_);
    plant_.servo_torque(q_, v_, q_ref_, v_ref_, torque_);
    recorder_.sample(plant_, time(), q_, v_, torque_, q_ref_, v_ref_, ledger_, interval);
    for (Vec3& impulse : ledger_.impulse) impulse.setZero();
  }

  PlantT plant_;
  Reference reference_;
  Driver driver_;
  Recorder recorder_;
  VectorXd q_, v_, torque_, q_ref_, v_ref_;
  EnergyLedger ledger_;
  double interval_;
  long now_;
};

template <template <class> class Driver>
std::unique_ptr<Rollout> start_adaptive(const RunSetup& setup) {
  using Arrow = Plant<ArrowSystem>;
  using Dense = Plant<DenseSystem>;
  if (setup.plant.arrow())
    return std::make_unique<AdaptiveRollout<Arrow, Driver<Arrow>>>(setup.plant.make<ArrowSystem>(),
                                                                   setup);
  return std::make_unique<AdaptiveRollout<Dense, Driver<Dense>>>(setup.plant.make<DenseSystem>(),
                                                                 setup);
}

}  // namespace hexapod
