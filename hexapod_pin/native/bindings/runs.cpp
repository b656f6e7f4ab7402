// Runs: start, advance, record, checkpoint. The interpreter is never held while one advances.
#include <nanobind/nanobind.h>
#include <nanobind/eigen/dense.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.hpp"
#include "run/batch.hpp"
#include "run/rollout.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace hexapod {

namespace {

Checkpoint make_checkpoint(long first, const VectorXd& q, const VectorXd& v,
                           const RowMatrix& contacts, const std::vector<double>& controller) {
  return {first, q, v, contacts, controller};
}

std::unique_ptr<Rollout> start(const PlantSettings& s, const std::vector<double>& time,
                               const RowMatrix& position, const RowMatrix& rate, bool held,
                               const Checkpoint& from, const std::string& method, double step,
                               long stride, double sample, double accuracy) {
  const Tree& tree = s.dynamics.tree();
  if (from.q.size() != tree.nq || from.v.size() != tree.nv)
    throw std::invalid_argument("q or v has the wrong size for this robot");
  const Eigen::Index contacts = Eigen::Index(s.mounts.size()) * s.terrain.max_contacts();
  if (from.contacts.rows() != 0 && (from.contacts.rows() != contacts || from.contacts.cols() != 6))
    throw std::invalid_argument("contact memories must be (contacts, 6)");
  const auto rows = Eigen::Index(time.size()), columns = Eigen::Index(tree.nv - 6);
  if (rows < 1 || position.rows() != rows || rate.rows() != rows || position.cols() != columns ||
      rate.cols() != columns)
    throw std::invalid_argument("set-points must be (knots, joints), one row per time");
  return start_run(method, {s, Reference(time, position, rate, held), from, step, stride, sample,
                            accuracy});
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

}  // namespace

void bind_runs(nb::module_& m) {
  nb::class_<Checkpoint>(m, "Checkpoint")
      .def_ro("first", &Checkpoint::first)
      .def_ro("q", &Checkpoint::q)
      .def_ro("v", &Checkpoint::v)
      .def_ro("contacts", &Checkpoint::contacts)
      .def_ro("controller", &Checkpoint::controller);
  nb::class_<Rollout>(m, "Rollout")
      .def("advance", &Rollout::advance, "samples"_a, nb::call_guard<nb::gil_scoped_release>(),
           "False where the run has diverged; the samples before stand.")
      .def("reserve", [](Rollout& rollout, std::size_t samples) { rollout.samples().reserve(samples); },
           "samples"_a, "Memory for so many more samples; without it, it grows.")
      .def("record", &record,
           nb::sig("def record(self) -> dict[str, numpy.ndarray[dtype=float64]]"),
           "Tables of the samples by name, one row per sample.")
      .def("counters", &Rollout::counters)
      .def("drive_counters", [](const Rollout& rollout) {
        const DriveCounters& c = rollout.drive_counters();
        return std::make_tuple(c.limit_count, c.limit_time, c.stop_count);
      }, "Per joint: times at the torque limit, time at it [s], times run into a stop.")
      .def("checkpoint", &Rollout::checkpoint);
  m.def("checkpoint", &make_checkpoint, "first"_a, "q"_a, "v"_a, "contacts"_a, "controller"_a);
  m.def("start", &start, "plant"_a, "time"_a, "position"_a, "rate"_a, "held"_a, "start"_a, "method"_a,
        "step"_a, "stride"_a, "sample"_a, "accuracy"_a);
  nb::class_<Batch>(m, "Batch", "Independent rollouts over threads; they begin when they are added.")
      .def(nb::init<int>(), "threads"_a)
      .def("add", &Batch::add, "rollout"_a, "samples"_a, nb::keep_alive<1, 2>())
      .def("next_done", &Batch::next_done, nb::call_guard<nb::gil_scoped_release>(),
           "Work until another one is done: its number, and whether it did not diverge; -1: none left.");
}

}  // namespace hexapod
