// Runs: start, command, advance, read, record, checkpoint. The interpreter is never held while one
// advances.
#include <nanobind/nanobind.h>
#include <nanobind/eigen/dense.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <limits>

#include "bindings/bindings.hpp"
#include "bindings/signal_watch.hpp"
#include "run/rollout.hpp"
#include "run/thread_team.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace hexapod {

namespace {

Checkpoint make_checkpoint(long first, double time, const VectorXd& q, const VectorXd& v,
                           const RowMatrix& contacts, const std::vector<double>& controller,
                           const RowMatrix& command, const RowMatrix& impulse) {
  return {first, time, q, v, contacts, controller, command, impulse};
}

Interpolation interpolation(const std::string& kind) {
  if (kind == "cubic") return Interpolation::cubic;
  if (kind == "quintic") return Interpolation::quintic;
  if (kind == "held") return Interpolation::held;
  if (kind == "linear") return Interpolation::linear;
  throw std::invalid_argument("set-points are cubic, quintic, held or linear, not " + kind);
}

void check_start(const PlantSettings& s, const Checkpoint& from) {
  const Tree& tree = s.dynamics.tree();
  if (from.q.size() != tree.nq || from.v.size() != tree.nv)
    throw std::invalid_argument("q or v has the wrong size for this robot");
  const Eigen::Index contacts = Eigen::Index(s.mounts.size()) * s.terrain.max_contacts();
  const bool wide = from.contacts.cols() == kMemoryColumns || from.contacts.cols() == kMemoryColumnsWithoutFace;
  if (from.contacts.rows() != 0 && (from.contacts.rows() != contacts || !wide))
    throw std::invalid_argument("contact memories must be (contacts, 12), or (contacts, 6)");
  if (from.contacts.cols() == kMemoryColumns) {
    const auto patches = from.contacts.rightCols(2).array();
    const double most = double(s.terrain.patches.size());
    if (!(patches == patches.round() && patches >= double(kUnseenPatch) && patches < most).all() ||
        !(patches.col(0) >= -1.0).all())
      throw std::invalid_argument("contact memories name a patch that the ground does not have");
  }
  if (from.impulse.rows() != 0 && (from.impulse.rows() != contacts || from.impulse.cols() != 3))
    throw std::invalid_argument("impulses must be (contacts, 3)");
  if (from.command.rows() != 0 && (from.command.rows() != 6 || from.command.cols() < tree.nv - 6))
    throw std::invalid_argument("a command in force must be (6, joints)");
}

// Set-points as NumPy holds them, without a copy.
using KnotRows = Eigen::Ref<const RowMatrix>;

Reference make_reference(const std::vector<double>& time, const KnotRows& position, const KnotRows& rate,
                         const std::string& kind, const KnotRows& acceleration) {
  const auto rows = Eigen::Index(time.size()), columns = position.cols();
  if (rows < 1 || position.rows() != rows || rate.rows() != rows || rate.cols() != columns)
    throw std::invalid_argument("set-points must be (knots, joints), one row per time");
  const Interpolation between = interpolation(kind);
  if (between == Interpolation::quintic &&
      (acceleration.rows() != rows - 1 || acceleration.cols() != 2 * columns))
    throw std::invalid_argument("accelerations of quintic set-points must be (knots - 1, 2 joints)");
  return Reference(time, position, rate, between, acceleration);
}

std::unique_ptr<Rollout> start(const PlantSettings& s, const std::vector<double>& time,
                               const KnotRows& position, const KnotRows& rate,
                               const std::string& kind, const Checkpoint& from,
                               const std::string& method, double step, long stride, double sample,
                               double tolerance, bool record, const VectorXd& rate_limit,
                               const std::vector<std::pair<Vec3, double>>& trunk,
                               const Vec3& window, const VectorXd& torque_limit,
                               const KnotRows& acceleration, const std::vector<std::string>& omitted,
                               double refinement, double evaluations, double smallest_step, double wall_time,
                               bool estimates, double end, bool dense, const RowMatrix& motors) {
  check_start(s, from);
  const auto columns = Eigen::Index(s.dynamics.tree().nv - 6);
  if (position.cols() != columns) throw std::invalid_argument("one set-point per joint needed");
  for (const VectorXd* limit : {&rate_limit, &torque_limit})
    if (limit->size() != 0 && limit->size() != columns)
      throw std::invalid_argument("one limit per joint needed");
  RunSetup setup{s, make_reference(time, position, rate, kind, acceleration), from, step, stride, sample, end,
                 {tolerance, refinement, sample, dense}, record, estimates, rate_limit, {window[0], window[1], window[2]}, torque_limit, {}, omitted,
                 {evaluations, smallest_step, wall_time}, motors};
  if (motors.rows() > 0 && (motors.rows() != columns || motors.cols() != WindingHeat::kColumns))
    throw std::invalid_argument("motors must be (joints, 7)");
  if (estimates && method != "ndf" && method != "extrapolated-euler")
    throw std::invalid_argument("only ndf and extrapolated-euler carry their error along");
  for (const auto& [offset, radius] : trunk) setup.trunk.push_back({offset, radius});
  return start_run(method, setup);
}

// More knots of a plan; the first one is the last that the run knows.
void extend_plan(Rollout& run, const std::vector<double>& time, const KnotRows& position,
                 const KnotRows& rate) {
  Reference& reference = run.reference();
  if (!reference.can_be_extended()) throw std::invalid_argument("only planned cubics can be extended");
  const auto rows = Eigen::Index(time.size());
  if (rows < 2 || position.rows() != rows || rate.rows() != rows ||
      position.cols() != reference.joints() || rate.cols() != reference.joints())
    throw std::invalid_argument("set-points must be (knots, joints), one row per time");
  if (time.front() != reference.end() || !std::is_sorted(time.begin(), time.end()))
    throw std::invalid_argument("set-points must begin where those before them end");
  reference.extend(time, position, rate);
}

// Angles, rates and accelerations of set-points at a time, as runs take them: (3, joints).
RowMatrix set_points_at(const std::vector<double>& time, const KnotRows& position, const KnotRows& rate,
                        const std::string& kind, const KnotRows& acceleration, double at) {
  Reference reference = make_reference(time, position, rate, kind, acceleration);
  const Eigen::Index n = position.cols();
  VectorXd q(n), v(n), a(n);
  reference.begin_step(at);
  reference.at(at, q, v, a);
  RowMatrix rows(3, n);
  rows << q.transpose(), v.transpose(), a.transpose();
  return rows;
}

// The rows so far, without a copy: the arrays share one block, which the run does not write again.
nb::dict record(Rollout& rollout) {
  SampleTables& samples = rollout.samples();
  using Block = std::shared_ptr<const double[]>;
  auto* block = new Block(samples.hand_over());
  nb::capsule owner(block, [](void* p) noexcept { delete static_cast<Block*>(p); });
  nb::dict out;
  for (std::size_t k = 0; k < samples.tables().size(); ++k) {
    const SampleTable& table = samples.tables()[k];
    auto* first = const_cast<double*>(block->get() + samples.offset(k));
    out[table.name] = nb::ndarray<nb::numpy, double>(first, {samples.rows(), table.width}, owner);
  }
  return out;
}

// Several runs at one time, row by row.
using Runs = std::vector<Rollout*>;

// What `work` returns, the interpreter free meanwhile but for signals and `poll`, which may end the runs.
template <class Work>
auto watched(const Runs& runs, nb::handle poll, const Work& work) {
  struct Watched {
    Watched(const Runs& runs, nb::handle poll) : runs(runs), watch(poll) {
      for (Rollout* run : runs) watch.put_on(run->monitor());
    }
    ~Watched() {
      for (Rollout* run : runs) SignalWatch::take_off(run->monitor());
    }
    const Runs& runs;
    SignalWatch watch;
  } watched(runs, poll);
  const auto result = [&] {
    const nb::gil_scoped_release released;
    return work();
  }();
  watched.watch.raise();
  return result;
}

bool advance(Rollout& run, long samples, nb::handle poll) {
  return watched({&run}, poll, [&] { return run.advance(samples); });
}

bool advance_to(Rollout& run, double time, nb::handle poll) {
  return watched({&run}, poll, [&] { return run.advance_to(time); });
}

const char* ended_by(Rollout& run) {
  switch (run.monitor().verdict()) {
    case WorkMonitor::Verdict::evaluations: return "evaluations";
    case WorkMonitor::Verdict::smallest_step: return "smallest_step";
    case WorkMonitor::Verdict::wall_time: return "wall_time";
    case WorkMonitor::Verdict::stopped: return "stopped";
    default: return "";
  }
}

std::vector<bool> advance_all(const Runs& runs, double until, int threads) {
  std::vector<char> good(runs.size());
  std::vector<std::exception_ptr> failure(runs.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t k; (k = next++) < runs.size();) {
      try {
        good[k] = runs[k]->advance_to(until);
      } catch (...) {
        failure[k] = std::current_exception();
      }
    }
  };
  {
    ThreadTeam others;
    others.begin(std::min(threads, int(runs.size())) - 1, work);
    work();
  }
  for (const std::exception_ptr& error : failure)
    if (error) std::rethrow_exception(error);
  return {good.begin(), good.end()};
}

std::vector<bool> advance_together(const Runs& runs, double until, int threads) {
  return watched(runs, {}, [&] { return advance_all(runs, until, threads); });
}

void command_together(const Runs& runs, const RowMatrix& position, const RowMatrix& rate,
                      const RowMatrix& torque, double arrival) {
  const auto rows = Eigen::Index(runs.size());
  if (position.rows() != rows || (rate.size() > 0 && rate.rows() != rows) ||
      (torque.size() > 0 && torque.rows() != rows))
    throw std::invalid_argument("a command has one row per run");
  DriveCommand command;
  command.arrival = arrival;
  for (Eigen::Index b = 0; b < rows; ++b) {
    command.position = position.row(b).transpose();
    if (rate.size() > 0) command.rate = rate.row(b).transpose();
    if (torque.size() > 0) command.torque = torque.row(b).transpose();
    runs[std::size_t(b)]->command(command);
  }
}

// Which of the values (B, n), row by row, is the first that is not finite or not between the limits (n);
// -1: none.
long first_outside(const RowMatrix& values, const VectorXd& lower, const VectorXd& upper) {
  if (lower.size() != values.cols() || upper.size() != values.cols())
    throw std::invalid_argument("one limit per column needed");
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    const double x = values.data()[k];
    const Eigen::Index j = k % values.cols();
    if (!(std::isfinite(x) && x >= lower[j] && x <= upper[j])) return long(k);
  }
  return -1;
}

using Rows = nb::ndarray<double, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;

// A row of `out` per run: angles, rates and torques of the joints, rotation of the trunk row by row,
// angular velocity, acceleration, force on each contact point, whether it is loaded.
void read_together(const Runs& runs, Rows out) {
  if (out.shape(0) != runs.size()) throw std::invalid_argument("one row per run needed");
  Reading r;
  for (std::size_t b = 0; b < runs.size(); ++b) {
    runs[b]->read(r);
    const std::size_t width = 3 * std::size_t(r.q.size()) + 15 + 4 * r.loaded.size();
    if (out.shape(1) != width) throw std::invalid_argument("a reading has another width");
    double* to = out.data() + b * width;
    for (const VectorXd* x : {&r.q, &r.v, &r.torque}) to = std::copy_n(x->data(), x->size(), to);
    for (int i = 0; i < 9; ++i) *to++ = r.rotation(i / 3, i % 3);
    to = std::copy_n(r.angular_velocity.data(), 3, to);
    to = std::copy_n(r.acceleration.data(), 3, to);
    to = std::copy_n(r.foot_force.data(), r.foot_force.size(), to);
    for (const char loaded : r.loaded) *to++ = double(loaded);
  }
}

using Touch = std::tuple<double, std::size_t, Vec3>;

std::vector<Touch> trunk_touches(const Rollout& run) {
  std::vector<Touch> out;
  for (const TrunkTouch& touch : run.trunk().touches())
    out.emplace_back(touch.time, touch.point, touch.place);
  return out;
}

void bind_several(nb::module_& m) {
  m.def("advance_together", &advance_together, "runs"_a, "until"_a, "threads"_a = 1,
        "All to one time [s], so many at a time; False: that run has diverged or ended.");
  m.def("command_together", &command_together, "runs"_a, "position"_a, "rate"_a, "torque"_a,
        "arrival"_a, "A row of set-points for each run, from its time on.");
  m.def("first_outside", &first_outside, "values"_a, "lower"_a, "upper"_a,
        "Index, row by row, of the first value that is not finite or outside its column's limits; -1: none.");
  m.def("read_together", &read_together, "runs"_a, "out"_a,
        "What sensors could read, into a row for each run: q, v, torque, rotation, angular velocity, "
        "acceleration, forces, loaded.");
}

}  // namespace

void bind_runs(nb::module_& m) {
  nb::class_<Checkpoint>(m, "Checkpoint")
      .def_ro("first", &Checkpoint::first)
      .def_ro("time", &Checkpoint::time)
      .def_ro("q", &Checkpoint::q)
      .def_ro("v", &Checkpoint::v)
      .def_ro("contacts", &Checkpoint::contacts)
      .def_ro("controller", &Checkpoint::controller)
      .def_ro("command", &Checkpoint::command)
      .def_ro("impulse", &Checkpoint::impulse);
  nb::class_<Rollout>(m, "Rollout")
      .def("advance", &advance, "samples"_a, "poll"_a = nb::none(),
           nb::sig("def advance(self, samples: int, poll: object = None) -> bool"),
           "False where the run has diverged or ended; the samples before stand. `poll` is called now "
           "and then; what it raises ends the run.")
      .def("advance_to", &advance_to, "time"_a, "poll"_a = nb::none(),
           nb::sig("def advance_to(self, time: float, poll: object = None) -> bool"),
           "The same to a time [s], after which commands may follow.")
      .def_prop_ro("ended_by", &ended_by,
                   "What has ended the run before its end: evaluations, smallest_step, wall_time, stopped; empty: nothing.")
      .def("trouble", [](Rollout& run) {
        const Trouble trouble = run.trouble();
        return std::make_tuple(trouble.step, trouble.coordinate, trouble.foot);
      }, "Of a run that has ended early: the last step tried [s], the coordinate of v whose error kept it "
         "small, the most loaded foot; -1: none.")
      .def_prop_ro("time", &Rollout::time)
      .def("set_points", &Rollout::set_points, "Set-points of the joint angles now [rad].")
      .def("extend_plan", &extend_plan, "time"_a, "position"_a, "rate"_a,
           "More knots of planned cubics; the first is the last that the run knows.")
      .def_prop_ro("plan_end", [](Rollout& run) { return run.reference().end(); },
                   "Time of the last knot [s].")
      .def("reserve", [](Rollout& rollout, std::size_t samples) { rollout.samples().reserve(samples); },
           "samples"_a, "Memory for so many more samples; without it, it grows.")
      .def("record", &record,
           nb::sig("def record(self) -> dict[str, numpy.ndarray[dtype=float64]]"),
           "Tables of the samples by name, one row per sample.")
      .def("trunk_touches", &trunk_touches,
           "Where points of the trunk have touched the ground: time [s], point, place [m].")
      .def("summary", [](Rollout& run) { return summary_data(run.summary()); },
           nb::sig("def summary(self) -> dict[str, typing.Any]"), "As `RunSummary.data`, so far.")
      .def("peak_states", [](Rollout& run) { return run.summary().peak_states(); },
           "A row per joint: time of its largest torque in the summary's window [s], and q, v, torques, forces "
           "on the feet then; NaN: there is none.")
      .def("half_summaries", [](Rollout& run) {
        return std::make_pair(summary_data(run.displaced_summary()), summary_data(run.other_summary()));
      }, nb::sig("def half_summaries(self) -> tuple[dict[str, typing.Any], dict[str, typing.Any]]"),
           "The same of half of the states, displaced by the error that the run has carried along, and of "
           "the other half, as they are.")
      .def("counters", &Rollout::counters)
      .def("drive_counters", [](const Rollout& rollout) {
        const DriveCounters& c = rollout.drive_counters();
        return std::make_tuple(c.limit_count, c.limit_time, c.stop_count);
      }, "Per joint: times at the torque limit, time at it [s], times run into a stop.")
      .def("checkpoint", &Rollout::checkpoint);
  m.def("checkpoint", &make_checkpoint, "first"_a, "time"_a, "q"_a, "v"_a, "contacts"_a,
        "controller"_a, "command"_a = RowMatrix(), "impulse"_a = RowMatrix());
  m.def("start", &start, "plant"_a, "time"_a, "position"_a, "rate"_a, "kind"_a, "start"_a, "method"_a,
        "step"_a, "stride"_a, "sample"_a, "tolerance"_a, "record"_a = true,
        "rate_limit"_a = VectorXd(), "trunk"_a = std::vector<std::pair<Vec3, double>>(),
        "window"_a = Vec3(0.0, std::numeric_limits<double>::infinity(), 0.0),
        "torque_limit"_a = VectorXd(), "acceleration"_a = RowMatrix(),
        "omitted"_a = std::vector<std::string>(), "refinement"_a = 1.0,
        "evaluations"_a = std::numeric_limits<double>::infinity(), "smallest_step"_a = 0.0,
        "wall_time"_a = std::numeric_limits<double>::infinity(), "estimates"_a = false,
        "end"_a = std::numeric_limits<double>::infinity(), "dense"_a = false,
        "motors"_a = RowMatrix());
  m.def("set_points_at", &set_points_at, "time"_a, "position"_a, "rate"_a, "kind"_a, "acceleration"_a,
        "at"_a, "Angles, rates and accelerations of set-points at one time, (3, joints).");
  bind_several(m);
  bind_batch(m);
}

}  // namespace hexapod
