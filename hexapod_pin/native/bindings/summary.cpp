// Summaries of runs: what was gathered at accepted states, as a dictionary of plain arrays.
#include "run/summary_numbers.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace hexapod {

namespace {

// For tests: feet as arrays.
void record_state(RunSummary& summary, double t, const VectorXd& q, const VectorXd& v,
                  const VectorXd& torque, const RowMatrix& force, const VectorXd& normal,
                  const VectorXd& slip, const Vec3& com, const VectorXd& rubbing) {
  std::vector<FootLoad> feet(std::size_t(normal.size()));
  for (std::size_t f = 0; f < feet.size(); ++f) {
    const auto i = Eigen::Index(f);
    feet[f] = {force.row(i).transpose(), normal[i], slip[i], rubbing.size() ? rubbing[i] : 0.0};
  }
  summary.record(t, q, v, torque, feet, com);
}

}  // namespace

nb::dict summary_data(RunSummary& summary) {
  nb::dict out;
  out["states"] = summary.states();
  if (summary.period() > 0.0) out["cycles"] = summary.cycles();
  else out["cycles"] = nb::none();
  for_each_number(summary, [&](const std::string& name, const auto& value) {
    out[nb::str(name.c_str())] = value;
  });
  return out;
}

void bind_summary(nb::module_& m) {
  nb::class_<RunSummary>(m, "RunSummary", "What a run gathers at its accepted states.")
      .def(nb::init<int, std::size_t>(), "joints"_a, "feet"_a)
      .def("set_window", &RunSummary::set_window, "begin"_a, "end"_a, "cycle"_a)
      .def("set_limit", &RunSummary::set_limit, "limit"_a)
      .def("record", &record_state, "t"_a, "q"_a, "v"_a, "torque"_a, "force"_a, "normal"_a, "slip"_a,
           "com"_a, "rubbing"_a = VectorXd(), "An accepted state; `rubbing`: friction powers of the feet, W.")
      .def("data", &summary_data, nb::sig("def data(self) -> dict[str, object]"),
           "Arrays and numbers by name; without peaks and means where no cycle is whole, whose number is "
           "None where nothing repeats.");
}

}  // namespace hexapod
