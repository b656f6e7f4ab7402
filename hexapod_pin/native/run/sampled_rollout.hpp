// What runs of fixed and of adaptive step share: plant, set-points, state, commands, readings, samples,
// checkpoints, and the clock that says where steps end.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "run/step_observer.hpp"
#include "run/rollout.hpp"
#include "run/summary.hpp"

namespace hexapod {

// Whether two times mean the same instant, of which one is a sum or product of rounded numbers.
inline bool same_time(double a, double b) {
  return std::abs(a - b) <= 1e-12 * std::max({1.0, std::abs(a), std::abs(b)});
}

template <class PlantT>
class SampledRollout : public Rollout, protected StepObserver {
 public:
  ~SampledRollout() override;

  SampleTables& samples() override { return recorder_.tables(); }
  const DriveCounters& drive_counters() const override { return plant_.drive_counters; }
  const TrunkWatch& trunk() const override { return trunk_; }
  RunSummary& summary() override { return summary_; }
  RunSummary& displaced_summary() override { return displaced_summary_; }
  RunSummary& other_summary() override { return other_summary_; }
  double time() const override { return time_; }
  Reference& reference() override { return reference_; }
  WorkMonitor& monitor() override { return monitor_; }

  void command(const DriveCommand& c) override;

  VectorXd set_points() override;

  void read(Reading& out) override;

 protected:
  SampledRollout(PlantT plant, const RunSetup& setup, bool differentiates_separated);

  // After the first evaluation: the sample of the start.
  void record_start(const Checkpoint& start);

  // At a multiple of the interval, or at the run's end, where that comes first.
  double next_sample() const { return earlier(double(sample_index_ + 1) * interval_); }

  // The time, or the run's end where that is earlier and not the same instant.
  double earlier(double time) const { return end_ < time && !same_time(end_, time) ? end_ : time; }

  // Where the step that begins now must end at the latest: at a sample, at `until`, at a jump of the
  // set-points, at a change of the loads. What is the same instant as a sample ends there.
  double next_stop(double until) const;

  // The same without the samples; what is the same instant as a sample is at its time.
  double horizon(double until) const;

  // At a sample, where the plant is evaluated.
  void arrive_at_sample(double t);

  // Loads that begin or end now.
  void begin_loads();

  bool loads_change(double before) const {
    return Loads::reached(plant_.loads.next_change(before), time_);
  }

  bool accepted(double t, const VectorXd& q, const VectorXd& v) override;

  bool looks_at_error() const override { return estimates_; }
  bool looks_at_forces() const override { return record_ && keeps_forces_; }

  // Every second state, and where a cycle ends; the others are summarised as they are: so the summaries
  // differ by what lies between states, too.
  bool looks_at_step(double t) override;

  void displaced_step(double t, const VectorXd& q, const VectorXd& v) override;

  void displaced_sample(double t, const VectorXd& q, const VectorXd& v, double force_error) override;

  Checkpoint checkpoint_now(std::vector<double> controller) const;

  bool ended() const { return monitor_.verdict() != WorkMonitor::Verdict::none; }

  // The most loaded foot; -1: none touches.
  long loaded_foot() const;

  PlantT plant_;
  Reference reference_;
  VectorXd q_, v_;
  EnergyLedger ledger_;
  double time_, start_, interval_, end_;  // end_: of the run, where it is known, s
  long sample_index_;

 private:
  static bool keeps_forces(const RunSetup& setup);

  // Motor torques at t in (q, v); not again where the run's own state has not changed.
  void find_torque(double t, const VectorXd& q, const VectorXd& v);

  // Of motors whose torque falls with speed: the line at this speed where it is below the limit given.
  void find_limits(RunSummary& summary, const VectorXd& v);

  // A state that the method has accepted, the plant evaluated there.
  void see(double t, const VectorXd& q, const VectorXd& v);

  // What `summarise` has found goes into another summary.
  void repeat(RunSummary& summary, double t, const VectorXd& q, const VectorXd& v);

  void summarise(RunSummary& summary, double t, const VectorXd& q, const VectorXd& v);

  // What the displaced sample differs by from the run's state, its torques and its forces.
  SampleError sample_error() const;

  // Records the state, the plant evaluated there, at the end of a sampling interval [s].
  void record(double interval);

  RowMatrix contact_memories() const;

  void restore_memories(const RowMatrix& rows);

  WorkMonitor monitor_;
  WindingHeat heat_;
  Recorder recorder_;
  TrunkWatch trunk_;
  RunSummary summary_, displaced_summary_, other_summary_;
  std::vector<FootLoad> foot_loads_;
  bool record_, estimates_, keeps_forces_, skipped_ = false;
  VectorXd rate_limit_, torque_limit_, limit_now_;
  bool has_lines_;
  SetPoints set_points_;
  static constexpr double kNever = -1.0;  // s
  double torque_time_ = kNever;           // of torque_, in the run's own state, s
  VectorXd torque_, acceleration_;
  double force_error_ = 0.0;  // of the sample that is recorded next, N
  VectorXd displaced_q_, displaced_torque_;  // of the same
};

}  // namespace hexapod
