// Summaries of runs: what was gathered at accepted states, as a dictionary of plain arrays.
#include "run/summary.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace hexapod {

namespace {

void put_peaks(nb::dict& out, const std::string& name, const Peaks& peaks) {
  out[nb::str(name.c_str())] = VectorXd(peaks.value);
  out[nb::str((name + "_time").c_str())] = VectorXd(peaks.time);
}

void put_joints(nb::dict& out, const SummaryTotals& totals) {
  const auto& sums = totals.sums_of_joints;
  const double time = totals.time;
  out["torque_rms"] = VectorXd((sums.col(0) / time).sqrt());
  out["speed_rms"] = VectorXd((sums.col(1) / time).sqrt());
  out["positive_energy"] = VectorXd(sums.col(2));
  out["negative_energy"] = VectorXd(sums.col(3));
  out["at_limit"] = VectorXd(sums.col(4) / time);
  out["angle_min"] = VectorXd(totals.lowest);
  out["angle_max"] = VectorXd(totals.highest);
  VectorXd p99(sums.rows());
  for (Eigen::Index j = 0; j < p99.size(); ++j) {
    const double found = totals.histogram[std::size_t(j)].quantile(0.99);
    p99[j] = std::min(found, totals.torque_peak.size[j]);  // the top bin ends above it
  }
  out["torque_p99"] = p99;
}

void put_feet(nb::dict& out, const SummaryTotals& totals) {
  const auto& sums = totals.sums_of_feet;
  out["normal_impulse"] = VectorXd(sums.col(0));
  out["impulse"] = RowMatrix(sums.middleCols(1, 3).matrix());
  out["slip_path"] = VectorXd(sums.col(4));
  out["loaded_time"] = VectorXd(sums.col(5));
}

void put_trunk(nb::dict& out, const SummaryTotals& totals) {
  const double time = totals.time;
  out["height_min"] = totals.least_height;
  out["height_max"] = totals.most_height;
  out["height_mean"] = totals.height / time;
  out["roll_mean"] = totals.roll / time;
  out["pitch_mean"] = totals.pitch / time;
  out["roll_rms"] = std::sqrt(totals.roll_square / time);
  out["pitch_rms"] = std::sqrt(totals.pitch_square / time);
  out["roll_peak"] = totals.roll_peak.value;
  out["pitch_peak"] = totals.pitch_peak.value;
  out["vertical_acceleration_rms"] = std::sqrt(totals.acceleration_square / time);
}

// For tests: feet as arrays.
void record_state(RunSummary& summary, double t, const VectorXd& q, const VectorXd& v,
                  const VectorXd& torque, const RowMatrix& force, const VectorXd& normal,
                  const VectorXd& slip, const Vec3& com) {
  std::vector<FootLoad> feet(std::size_t(normal.size()));
  for (std::size_t f = 0; f < feet.size(); ++f) {
    const auto i = Eigen::Index(f);
    feet[f] = {force.row(i).transpose(), normal[i], slip[i]};
  }
  summary.record(t, q, v, torque, feet, com);
}

}  // namespace

nb::dict summary_data(RunSummary& summary) {
  const SummaryTotals& totals = summary.totals();
  nb::dict out;
  out["states"] = summary.states();
  out["cycles"] = summary.cycles();
  out["period"] = summary.period();
  out["time"] = totals.time;
  out["first_yaw"] = summary.first_yaw();
  const std::vector<WayPoint> way = summary.way();
  RowMatrix points(Eigen::Index(way.size()), 4);
  for (std::size_t k = 0; k < way.size(); ++k)
    points.row(Eigen::Index(k)) << way[k].time, way[k].x, way[k].y, way[k].yaw;
  out["way"] = points;
  put_peaks(out, "outside_torque", summary.outside_torque());
  put_peaks(out, "outside_force", summary.outside_force());
  if (totals.time <= 0.0) return out;  // no whole cycle
  put_peaks(out, "torque_peak", totals.torque_peak);
  put_peaks(out, "speed_peak", totals.speed_peak);
  put_peaks(out, "power_peak", totals.power_peak);
  put_peaks(out, "force_peak", totals.force_peak);
  put_joints(out, totals);
  put_feet(out, totals);
  put_trunk(out, totals);
  return out;
}

void bind_summary(nb::module_& m) {
  nb::class_<RunSummary>(m, "RunSummary", "What a run gathers at its accepted states.")
      .def(nb::init<int, std::size_t>(), "joints"_a, "feet"_a)
      .def("set_window", &RunSummary::set_window, "begin"_a, "end"_a, "cycle"_a)
      .def("set_limit", &RunSummary::set_limit, "limit"_a)
      .def("record", &record_state, "t"_a, "q"_a, "v"_a, "torque"_a, "force"_a, "normal"_a, "slip"_a,
           "com"_a, "An accepted state.")
      .def("data", &summary_data, nb::sig("def data(self) -> dict[str, object]"),
           "Arrays and numbers by name; without peaks and means where no cycle is whole.");
}

}  // namespace hexapod
