// A run as the bindings and batches see it: sampled on the fixed grid k * sample, with commands and
// measurements at any time between.
#pragma once

#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "methods/resolution.hpp"
#include "plant/reference.hpp"
#include "plant/settings.hpp"
#include "run/recorder.hpp"
#include "run/summary.hpp"
#include "run/trunk_watch.hpp"
#include "run/work_monitor.hpp"

namespace hexapod {

constexpr double kDivergedSpeed = 1e4;  // rad/s and m/s: beyond it a run has diverged

constexpr int kMemoryColumns = 12, kMemoryColumnsWithoutFace = 6;  // of a checkpoint's contacts

// A run at one time: all that its continuation depends on.
struct Checkpoint {
  long first = 0;      // samples up to here: the next is at (first + 1) * sample interval
  double time = 0.0;   // s, not before first * sample interval
  VectorXd q, v;
  // A row per contact: touch speed, stretch (3), touching, sliding, face (3) and gap to it; none: all new. Earlier
  // releases did not keep the faces.
  RowMatrix contacts;
  std::vector<double> controller;  // what an adaptive method's next step depends on; none: new
  RowMatrix command;               // the command that acts, as `Reference::pending`; none: planned
  RowMatrix impulse;               // of each contact since the last sample, N s; none: zero
};

// Whole gait cycles that a summary is of: `RunSummary::set_window`.
struct SummaryWindow {
  double begin = 0.0, end = std::numeric_limits<double>::infinity(), cycle = 0.0;  // s
};

struct RunSetup {
  PlantSettings plant;
  Reference reference;
  Checkpoint start;
  double step = 0.0;      // of a fixed-step method, s
  long stride = 1;        // steps between samples
  double sample = 0.0;    // time between samples, s
  double end = std::numeric_limits<double>::infinity();  // of the run, where it is known, s: no step goes beyond
  Resolution resolution;  // of an adaptive method
  bool record = true;     // whether samples are kept
  bool estimates = false;  // whether a method that can carries its error along, and it is kept
  VectorXd rate_limit;    // of the set-points that commands move, rad/s; none: no limit
  SummaryWindow window;
  VectorXd torque_limit;          // N m, from which a summary counts a joint at its limit; none: never
  std::vector<TrunkPoint> trunk;  // watched for touching the ground
  std::vector<std::string> omitted;  // tables of samples that are not kept
  WorkLimits limits;
  RowMatrix motors;  // whose currents and temperatures are sampled, as of `WindingHeat`; none: they are not
};

// A command to the drives: see `Reference::command`.
struct DriveCommand {
  VectorXd position, rate, torque;  // rad, rad/s (none: below), N m (none: 0)
  // s, not before `now`, and as late as the limits of rates want it. Where it is finite, the set-points go
  // there on cubics that begin with their rates and end with `rate`, or with the mean rate of the way where
  // there is none. Else they are there at once, or straight on the way, and have `rate`, or 0.
  double arrival = -std::numeric_limits<double>::infinity();
};

// What sensors could read at one state.
struct Reading {
  double time = 0.0;
  VectorXd q, v, torque;  // joints
  Mat3 rotation;          // trunk to world axes
  Vec3 angular_velocity, acceleration;  // trunk axes; acceleration less gravity
  RowMatrix foot_force;                 // world axes, a row per mount
  std::vector<char> loaded;
};

// Where a run that has ended early got stuck.
struct Trouble {
  double step;      // the last one tried, s
  long coordinate;  // of the velocity, whose error kept the step small; -1: not known
  long foot;        // the most loaded; -1: none touches
};

// As strictly aligned as any run is: Python's side frees a run as a Rollout, and must give its memory back
// in the way in which it was taken.
class alignas(64) Rollout {
 public:
  virtual ~Rollout() = default;
  virtual bool advance(long samples) = 0;  // false: diverged or ended; the samples before stand
  // To a time between samples too, after which commands may follow. False: diverged or ended.
  virtual bool advance_to(double time) = 0;
  virtual double time() const = 0;
  virtual void command(const DriveCommand& command) = 0;  // at the time reached
  virtual Reference& reference() = 0;
  virtual VectorXd set_points() = 0;                      // angles at the time reached, rad
  virtual void read(Reading& reading) = 0;                // at the time reached
  virtual SampleTables& samples() = 0;
  virtual const TrunkWatch& trunk() const = 0;
  virtual RunSummary& summary() = 0;
  // Of half of the states, displaced by the run's error; of the other half, as they are.
  virtual RunSummary& displaced_summary() = 0;
  virtual RunSummary& other_summary() = 0;
  virtual std::map<std::string, double> counters() const = 0;
  virtual Checkpoint checkpoint() const = 0;
  virtual const DriveCounters& drive_counters() const = 0;
  virtual WorkMonitor& monitor() = 0;
  virtual Trouble trouble() const = 0;
};

// One function per method, each compiled in a unit of its own.
std::unique_ptr<Rollout> start_implicit_euler(const RunSetup& setup);
std::unique_ptr<Rollout> start_rk4(const RunSetup& setup);
std::unique_ptr<Rollout> start_robust(const RunSetup& setup);
std::unique_ptr<Rollout> start_robust_reference(const RunSetup& setup);
std::unique_ptr<Rollout> start_extrapolated_euler(const RunSetup& setup);
std::unique_ptr<Rollout> start_ndf(const RunSetup& setup);
std::unique_ptr<Rollout> start_dop853(const RunSetup& setup);
std::unique_ptr<Rollout> start_run(const std::string& method, const RunSetup& setup);

template <class Run, class PlantT>
std::unique_ptr<Rollout> start_run_of(PlantT plant, const RunSetup& setup) {
  static_assert(alignof(Run) == alignof(Rollout));
  return std::make_unique<Run>(std::move(plant), setup);
}

}  // namespace hexapod
