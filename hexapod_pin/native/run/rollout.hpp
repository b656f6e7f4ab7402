// A run as the bindings and batches see it: sampled on the fixed grid (first + k) * stride * step.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "plant/reference.hpp"
#include "plant/settings.hpp"
#include "run/recorder.hpp"

namespace hexapod {

constexpr double kDivergedSpeed = 1e4;  // rad/s and m/s: beyond it a run has diverged

// A run at one sample: all that its continuation depends on.
struct Checkpoint {
  long first = 0;      // its time is first * sample interval
  VectorXd q, v;
  RowMatrix contacts;  // a row per contact: touch speed, stretch (3), touching, sliding; none: all new
  std::vector<double> controller;  // what an adaptive method's next step depends on; none: new
};

struct RunSetup {
  PlantSettings plant;
  Reference reference;
  Checkpoint start;
  double step = 0.0;      // of a fixed-step method, s
  long stride = 1;        // steps between samples
  double sample = 0.0;    // time between samples, s
  double accuracy = 0.0;  // of an adaptive method, m and rad
};

class Rollout {
 public:
  virtual ~Rollout() = default;
  virtual bool advance(long samples) = 0;  // false: diverged; the samples before stand
  virtual SampleTables& samples() = 0;
  virtual std::map<std::string, double> counters() const = 0;
  virtual Checkpoint checkpoint() const = 0;
  virtual const DriveCounters& drive_counters() const = 0;
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

}  // namespace hexapod
