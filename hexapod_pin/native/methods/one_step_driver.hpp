// Runs a one-step method with error control; steps end at jumps of the set-points, at touch-downs and at
// switches of the drives. Where the method knows the states within a step and the resolution is dense,
// samples between its ends are taken before the step is accepted: contacts and drives are as they were at
// its start, as they are all through it. Else steps end at samples, too.
// The error of the whole run is carried along where the observer looks at it and the method allows it; else
// only those of the steps are known, and that of the whole is found by comparing two runs.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "methods/carried_error.hpp"
#include "methods/error_control.hpp"
#include "methods/chart_flow.hpp"
#include "methods/drive_events.hpp"
#include "methods/resolution.hpp"
#include "methods/step_control.hpp"
#include "methods/touch_down_locator.hpp"
#include "run/step_observer.hpp"
#include "run/rollout.hpp"

namespace hexapod {

template <class PlantT, template <class> class Stepper>
class OneStepDriver {
  using Method = Stepper<PlantT>;

 public:
  static constexpr bool kRestarts = false;  // a run that goes on from a checkpoint takes the same steps

  // `memory` of an earlier driver's controller, or empty
  OneStepDriver(PlantT& plant, Reference& reference, const Resolution& resolution,
                const std::vector<double>& memory, StepObserver& observer)
      : flow_(plant, reference), method_(plant), observer_(observer), resolution_(resolution),
        norm_{local_tolerance(plant, reference, resolution.tolerance),
              Method::kLeastVelocityWeight,
              Method::kWeightFollowsFriction
                  ? resolution.refinement * plant.law.friction.steepness()
                  : 0.0},
        touch_(plant.feet.size(), norm_.tolerance, plant.law.normal.needs_touch_speed(),
               true),
        drives_(flow_, norm_) {
    if (observer.looks_at_error()) carried_.emplace(flow_, observer);
    if (memory.size() != 1 + StepControl::kMemorySize + Method::kMemorySize) return;
    watched_until_ = memory[0];
    control_.restore(memory.data() + 1);
    method_.restore(memory.data() + 1 + StepControl::kMemorySize);
  }

  // From t to `stop`, in steps that may end beyond it but not beyond `horizon`, the set-points' next
  // jump. The plant is evaluated at (t, q, v) before and at `stop` after. False: no step of a
  // reasonable size is accurate enough, or the run is to end.
  bool advance(double t, double stop, double horizon, VectorXd& q, VectorXd& v,
               EnergyLedger& ledger) {
    if (!Method::kDense || !resolution_.dense) horizon = stop;
    if (!under_way_) {
      drives_.start(flow_.plant, flow_.reference, t, q, v);
      if (flow_.reference.may_jump_at(t)) control_.jump();
    }
    while (under_way_ || t < stop) {
      if (!under_way_ && !begin_step(t, horizon, q, v)) return false;
      if (stop < end_) {
        sample(stop, q, v, ledger);
        return true;
      }
      if (!accept_step(stop, q, v, ledger)) return false;
      t = end_;
    }
    return true;
  }

  double step() const { return control_.step(); }  // s
  double reached() const { return reached_; }  // time of the last step accepted, s
  long worst_coordinate() const { return flow_.worst_coordinate(error_, norm_, step()); }

  std::vector<double> memory() const {
    std::vector<double> all{watched_until_};
    for (const auto& part : {control_.memory(), method_.memory()})
      all.insert(all.end(), part.begin(), part.end());
    return all;
  }

  std::map<std::string, double> counters() const {
    std::map<std::string, double> all{
            {"steps", double(steps_)},       {"rejected", double(rejected_)},
            {"events", double(events_)},     {"largest_turn", largest_turn_},
            {"refined", double(refined_)},
            {"error_most", error_most_},     {"error_sum", error_sum_}};
    if (carried_) carried_->add_counters(all);
    return all;
  }

 private:
  // Finds the step from t, not beyond `horizon`, where the plant is evaluated at (t, q, v), and leaves it
  // evaluated at the step's end; false if there is none.
  bool begin_step(double t, double horizon, const VectorXd& q, const VectorXd& v) {
    flow_.begin(q, v, y0_);
    touch_.begin(flow_.plant);
    const double rest = horizon - t;
    double longest = touch_.longest_step(flow_.plant);
    if (!stands()) longest = std::min(longest, resolution_.longest_step(rest));
    const double h = fit_step(std::min(control_.step(), longest), rest);
    drives_.weigh(flow_.plant, Method::kLeastVelocityWeight, Method::kHardVelocityWeight, norm_);
    if constexpr (!Method::kSeesEnd) remember_slips();
    if (PlantT::kPrescribed && t < watched_until_) start_torque_ = flow_.reaction_torque(t);
    method_.begin(flow_, t, y0_);
    const double done = step_from(t, h);
    if (done <= 0.0 || !(flow_.velocity().cwiseAbs().maxCoeff() < kDivergedSpeed)) return false;
    begin_ = t, end_ = done == rest ? horizon : t + done, length_ = done;
    if (carried_) carried_->add(flow_, y1_, error_, length_);
    under_way_ = true;
    return true;
  }

  // The state at t, within the step under way; what its end needs is saved.
  void sample(double t, VectorXd& q, VectorXd& v, EnergyLedger& ledger) {
    if constexpr (Method::kDense) {
      if (sampled_) flow_.plant.restore_evaluation();
      else booked_works_.setZero(flow_.nw);
      method_.interpolate((t - begin_) / length_, y0_, y1_, sample_);
      flow_.save_evaluation();
      if (carried_) carried_->show_sample(flow_, t, sample_);
      flow_.evaluate(t, sample_);
      q = flow_.position();
      v = flow_.velocity();
      ledger.add(flow_.w(sample_) - booked_works_);
      booked_works_ = flow_.w(sample_);
      sampled_ = true;
    }
  }

  // The step under way, which ends at `stop` or before, becomes part of the run; false if that is to end.
  bool accept_step(double stop, VectorXd& q, VectorXd& v, EnergyLedger& ledger) {
    under_way_ = false;
    if (sampled_) {
      flow_.restore_evaluation(end_, y1_);
      flow_.w(y1_) -= booked_works_;
      sampled_ = false;
    }
    if (carried_) {
      carried_->show_step(flow_, end_, y1_);
      if (end_ == stop) carried_->show_sample(flow_, end_, y1_);
      carried_->move_chart(flow_, y1_);
    }
    flow_.accept(y1_, q, v, ledger);
    drives_.accept(flow_.plant, flow_.reference, end_, length_, q, v);
    ++steps_;
    largest_turn_ = std::max(largest_turn_, length_ * v.tail(v.size() - 3).cwiseAbs().maxCoeff());
    reached_ = end_;
    return observer_.accepted(end_, q, v);
  }

  static constexpr double kHardDriveShare = 0.1;  // of the usual tolerance, with hard drives
  static constexpr int kMaxTries = 60, kMaxEventTries = 4, kMaxSwitchTries = 8;
  // Steps show the peaks of torques that touch-downs leave: for a while, a torque changes in one of them
  // by no more than this share of the joint's largest, unless the step is very short.
  static constexpr double kWatchedTime = 2e-3;  // s, after a touch-down
  static constexpr double kMostTorqueChange = 0.06;
  static constexpr double kTorqueAim = 0.6;        // of that share, in the next try or step
  static constexpr double kLeastTorqueStep = 1e-5;  // s
  static constexpr double kLeastEventStep = 1e-11;  // s, and of the time
  static constexpr double kSlideSpeed = 3.0;    // of the friction law's speed scale
  static constexpr double kNearlyAtRest = 9.0;  // likewise
  static constexpr double kLeastShare = 1e-3;  // of a step: where the ground has a jump, the gap has no root

  // What one step may lose, by the method and by what this scene needs, m and rad.
  static double local_tolerance(const PlantT& plant, const Reference& reference, double tolerance) {
    const double own = Method::tolerance_share(tolerance) * tolerance;
    if (PlantT::kPrescribed) return Method::prescribed_share(tolerance) * own;
    return DriveEvents<PlantT>::hard(plant, reference) ? kHardDriveShare * own : own;
  }

  // Whether feet and servos hold the robot: errors do not stay there as they do in flight and where feet
  // slide, and steps that end at samples may be the same in a finer run.
  bool stands() const {
    const auto& feet = flow_.plant.feet;
    const auto holds = [this](const auto& foot) { return foot.active && !slides(foot); };
    return flow_.plant.joints() > 0 && std::count_if(feet.begin(), feet.end(), holds) >= 3;
  }

  template <class Contact>
  bool slides(const Contact& foot) const {
    const FrictionLaw& law = flow_.plant.law.friction;
    if (law.has_bristle()) return foot.memory.sliding;
    return law.steepness() * in_plane(foot.ground.normal, foot.velocity).norm() > kSlideSpeed;
  }

  // How feet slide where a step begins, by a law of friction that is smooth.
  void remember_slips() {
    const auto& feet = flow_.plant.feet;
    slips_.assign(feet.size(), Vec3::Zero());
    if (!(flow_.plant.law.friction.steepness() > 0.0)) return;
    for (std::size_t i = 0; i < feet.size(); ++i)
      if (feet[i].active && slides(feet[i])) slips_[i] = in_plane(feet[i].ground.normal, feet[i].velocity);
  }

  // Share of the step whose end has been evaluated, at which the first foot nearly rests of those that slide one
  // way at its start and the other way at its end; 1 if none does. A method that has not looked at the end may
  // have seen the same friction all the way, and no error; from nearly at rest it sees how the friction changes.
  double share_until_rest() const {
    double share = 1.0;
    for (std::size_t i = 0; i < slips_.size(); ++i) {
      const auto& foot = flow_.plant.feet[i];
      const double before = slips_[i].norm();
      if (before == 0.0 || !foot.active || !slides(foot)) continue;
      const double after = slips_[i].dot(foot.velocity) / before;
      const double slow = std::min(kNearlyAtRest / flow_.plant.law.friction.steepness(), 0.5 * before);
      if (after < 0.0) share = std::min(share, (before - slow) / (before - after));
    }
    return share;
  }

  // Accepts a step of h, shorter where its error, a touch-down, a switch of a drive, a foot that turns back or
  // the change of a torque requires it, and leaves the plant evaluated at its end; returns its length, or -1.
  // `size` is the error over the tolerance: a step is rejected above 1, or where the error is not a number.
  double step_from(double t, double h) {
    const bool cut = h < control_.step();  // by the grid: it must not shrink the remembered step
    int located = 0, switched = 0;
    const double least = kLeastEventStep * std::max(1.0, std::abs(t));
    for (int tries = 0; tries < kMaxTries && t + h > t; ++tries) {
      drives_.begin(t);
      const double found = method_.attempt(flow_, t, h, y0_, norm_, y1_, error_);
      const double size = y1_.allFinite() ? found : std::numeric_limits<double>::infinity();
      if (!(size <= 1.0)) {
        ++rejected_;
        h = control_.after_rejection(h, size, method_.order());
      } else {
        flow_.evaluate(t + h, y1_);
        const double touch = located < kMaxEventTries && h > least ? touch_.share(flow_.plant, h) : 1.0;
        double drive = std::min(drives_.share(t + h, y1_, h), share_until_rest());
        if (switched == kMaxSwitchTries || h < least) drive = 1.0;
        const double change =
            t < watched_until_ ? torque_change(t + h) / kMostTorqueChange : 0.0;
        if (change > 1.0 && h > kLeastTorqueStep) {
          ++refined_;
          control_.shorten(h *= std::max(0.25, kTorqueAim / change));
          flow_.restore_evaluation(t, y0_);
          continue;
        }
        const double first = std::min(touch, drive);
        if (first == 1.0) {
          accept(h, size, cut, located + switched > 0);
          if (carried_ && located + switched > 0) carried_->happened(t + h);
          if (located > 0) watched_until_ = t + h + kWatchedTime;
          if (change > kTorqueAim) control_.bound(h * kTorqueAim / change);
          return h;
        }
        ++(drive < touch ? switched : located);
        h *= std::max(first, kLeastShare);
      }
      flow_.restore_evaluation(t, y0_);
    }
    return -1.0;
  }

  // Largest change of a motor's torque in the step that ends at t, as a share of its cap.
  double torque_change(double t) {
    if constexpr (!PlantT::kPrescribed) return drives_.torque_change(flow_.plant);
    const auto change = (flow_.reaction_torque(t) - start_torque_).array().abs();
    const auto& cap = flow_.plant.drive.cap.array();
    return (cap > 0.0).select(change / cap, 0.0).maxCoeff();  // an effort of 0 says nothing
  }

  void accept(double h, double size, bool cut, bool located) {
    control_.after_acceptance(h, size, method_.order(), cut, located);
    events_ += located;
    const double local = flow_.xi(error_).cwiseAbs().maxCoeff();
    error_most_ = std::max(error_most_, local);
    error_sum_ += local;
  }

  ChartFlow<PlantT> flow_;
  Method method_;
  StepObserver& observer_;
  Resolution resolution_;
  ErrorNorm norm_;
  TouchDownLocator touch_;
  DriveEvents<PlantT> drives_;
  StepControl control_;
  std::optional<CarriedError<PlantT>> carried_;
  double watched_until_ = 0.0, reached_ = 0.0;  // s
  VectorXd y0_, y1_, error_;
  double begin_ = 0.0, end_ = 0.0, length_ = 0.0;  // of the last step found, s
  bool under_way_ = false;  // it is not accepted yet
  bool sampled_ = false;    // the plant is evaluated at a sample within it, its end is saved
  VectorXd sample_, booked_works_;  // the last sample within it
  VectorXd start_torque_;  // of a prescribed motion, N m
  std::vector<Vec3> slips_;  // of feet where a step begins, 0 where they do not slide, m/s; see kSeesEnd
  long steps_ = 0, rejected_ = 0, events_ = 0, refined_ = 0;
  double largest_turn_ = 0.0, error_most_ = 0.0, error_sum_ = 0.0;
};

}  // namespace hexapod
