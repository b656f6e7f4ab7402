// A run: steps on the fixed grid t0 + k h, sampled every `stride` steps, stopped at the first
// state that is not finite or faster than any robot.
#pragma once

#include <memory>
#include <string>

#include "implicit_euler.hpp"
#include "plant.hpp"
#include "recorder.hpp"
#include "reference.hpp"
#include "rk4.hpp"

namespace hexapod {

constexpr double kMostSpeed = 1e4;  // rad/s or m/s: beyond it a run has diverged

class Rollout {  // interface seen by the bindings and by batches
 public:
  virtual ~Rollout() = default;
  virtual bool advance(long steps) = 0;  // false: diverged, the last good sample stands
  virtual const Recorder& record() const = 0;
  virtual std::map<std::string, double> counters() const = 0;
  virtual VectorXd q() const = 0;
  virtual VectorXd v() const = 0;
};

template <class PlantT, class Integrator>
class FixedStepRollout final : public Rollout {
 public:
  FixedStepRollout(PlantT plant, Reference reference, VectorXd q, VectorXd v, double t0, double h,
                   long stride)
      : plant_(std::move(plant)), reference_(std::move(reference)), integrator_(plant_),
        recorder_(plant_), q_(std::move(q)), v_(std::move(v)), torque_(plant_.joints()),
        q_ref_(plant_.joints()), v_ref_(plant_.joints()), account_(plant_.feet.size()), t0_(t0),
        h_(h), stride_(stride) {
    evaluate();
    sample(0.0);
  }

  bool advance(long steps) override {
    for (long k = 0; k < steps; ++k) {
      integrator_.step(plant_, reference_, time(), h_, q_, v_, account_);
      ++step_;
      const double speed = v_.cwiseAbs().maxCoeff();
      if (!(speed < kMostSpeed) || !q_.allFinite()) return false;
      evaluate();
      if (step_ % stride_ == 0) sample(h_ * double(stride_));
    }
    return true;
  }

  const Recorder& record() const override { return recorder_; }
  VectorXd q() const override { return q_; }
  VectorXd v() const override { return v_; }

  std::map<std::string, double> counters() const override {
    std::map<std::string, double> all = integrator_.counters();
    all["steps"] = double(step_);
    all["evaluations"] = double(plant_.evaluations);
    return all;
  }

 private:
  double time() const { return t0_ + double(step_) * h_; }

  void evaluate() {
    plant_.evaluate(time(), q_, v_, Integrator::kAtEnd ? h_ : 0.0);
    plant_.settle_memory();
  }

  void sample(double interval) {
    reference_.at(time(), q_ref_, v_ref_);
    plant_.servo_torque(q_, v_, q_ref_, v_ref_, torque_);
    recorder_.sample(plant_, time(), q_, v_, torque_, q_ref_, v_ref_, account_, interval);
    for (Vec3& impulse : account_.impulse) impulse.setZero();
  }

  PlantT plant_;
  Reference reference_;
  Integrator integrator_;
  Recorder recorder_;
  VectorXd q_, v_, torque_, q_ref_, v_ref_;
  Account account_;
  double t0_, h_;
  long stride_, step_ = 0;
};

template <class PlantT>
std::unique_ptr<Rollout> make_rollout(const std::string& method, PlantT plant, Reference reference,
                                      VectorXd q, VectorXd v, double t0, double h, long stride) {
  if (method == "implicit-euler")
    return std::make_unique<FixedStepRollout<PlantT, ImplicitEuler<PlantT>>>(
        std::move(plant), std::move(reference), std::move(q), std::move(v), t0, h, stride);
  if (method == "rk4")
    return std::make_unique<FixedStepRollout<PlantT, RungeKutta4<PlantT>>>(
        std::move(plant), std::move(reference), std::move(q), std::move(v), t0, h, stride);
  throw std::invalid_argument("unknown method " + method);
}

}  // namespace hexapod
