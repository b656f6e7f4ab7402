// A run on the fixed grid k h, sampled every `stride` steps, stopped at the first state that is not
// finite or faster than any robot.
#pragma once

#include "run/rollout.hpp"

namespace hexapod {

template <class PlantT, class Integrator>
class FixedStepRollout final : public Rollout {
 public:
  FixedStepRollout(PlantT plant, const RunSetup& setup)
      : plant_(std::move(plant)), reference_(setup.reference), integrator_(plant_),
        recorder_(plant_), q_(setup.start.q), v_(setup.start.v), torque_(plant_.joints()),
        q_ref_(plant_.joints()), v_ref_(plant_.joints()), ledger_(plant_.feet.size()),
        h_(setup.step), stride_(setup.stride), now_(setup.start.first * setup.stride) {
    plant_.look_ahead = Integrator::kLooksAhead;
    restore_memories(plant_, setup.start.contacts);
    evaluate();
    sample(0.0);
  }

  bool advance(long samples) override {
    for (long k = 0; k < samples * stride_; ++k) {
      reference_.begin_step(time());
      integrator_.step(plant_, reference_, time(), h_, q_, v_, ledger_);
      ++now_;
      ++steps_;
      const double speed = v_.cwiseAbs().maxCoeff();
      if (!(speed < kMostSpeed) || !q_.allFinite()) return false;
      evaluate();
      if (now_ % stride_ == 0) sample(h_ * double(stride_));
    }
    return true;
  }

  const Recorder& record() const override { return recorder_; }

  Checkpoint checkpoint() const override {
    return {now_ / stride_, q_, v_, contact_memories(plant_), {}};
  }

  std::map<std::string, double> counters() const override {
    std::map<std::string, double> all = integrator_.counters();
    all["steps"] = double(steps_);
    all["evaluations"] = double(plant_.evaluations);
    return all;
  }

 private:
  double time() const { return double(now_) * h_; }

  void evaluate() {
    plant_.evaluate(time(), q_, v_, Integrator::kAtEnd ? h_ : 0.0);
    plant_.settle_memory();
  }

  void sample(double interval) {
    reference_.begin_step(time());
    reference_.at(time(), q_ref_, v_ref_);
    plant_.servo_torque(q_, v_, q_ref_, v_ref_, torque_);
    recorder_.sample(plant_, time(), q_, v_, torque_, q_ref_, v_ref_, ledger_, interval);
    for (Vec3& impulse : ledger_.impulse) impulse.setZero();
  }

  PlantT plant_;
  Reference reference_;
  Integrator integrator_;
  Recorder recorder_;
  VectorXd q_, v_, torque_, q_ref_, v_ref_;
  EnergyLedger ledger_;
  double h_;
  long stride_, now_, steps_ = 0;
};

template <template <class> class Integrator>
std::unique_ptr<Rollout> start_fixed_step(const RunSetup& setup) {
  using Arrow = Plant<ArrowSystem>;
  using Dense = Plant<DenseSystem>;
  if (setup.plant.arrow())
    return std::make_unique<FixedStepRollout<Arrow, Integrator<Arrow>>>(
        setup.plant.make<ArrowSystem>(), setup);
  return std::make_unique<FixedStepRollout<Dense, Integrator<Dense>>>(
      setup.plant.make<DenseSystem>(), setup);
}

}  // namespace hexapod
