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

void put_joints(nb::dict& out, JointTotals& joints, double time) {
  const auto column = [&](auto value) {
    const std::vector<JointSums>& sums = joints.sums();
    VectorXd values(Eigen::Index(sums.size()));
    for (std::size_t j = 0; j < sums.size(); ++j) values[Eigen::Index(j)] = value(sums[j]);
    return values;
  };
  put_peaks(out, "torque_peak", joints.peaks(&JointSums::torque));
  put_peaks(out, "speed_peak", joints.peaks(&JointSums::speed));
  put_peaks(out, "power_peak", joints.peaks(&JointSums::power));
  out["torque_rms"] = column([&](const JointSums& s) { return std::sqrt(s.torque_square / time); });
  out["speed_rms"] = column([&](const JointSums& s) { return std::sqrt(s.rate_square / time); });
  out["positive_energy"] = column([](const JointSums& s) { return s.positive_energy; });
  out["negative_energy"] = column([](const JointSums& s) { return s.negative_energy; });
  out["at_limit"] = column([&](const JointSums& s) { return s.at_limit / time; });
  out["limit_use"] = column([](const JointSums& s) { return s.limit_use; });
  out["acceleration_rms"] = VectorXd((joints.acceleration_square / time).sqrt());
  out["torque_acceleration"] = VectorXd(joints.torque_acceleration / time);
  out["angle_min"] = column([](const JointSums& s) { return s.lowest; });
  out["angle_max"] = column([](const JointSums& s) { return s.highest; });
  VectorXd p99 = joints.peaks(&JointSums::torque).size;  // the top bin of a histogram ends above it
  for (Eigen::Index j = 0; j < p99.size(); ++j)
    p99[j] = std::min(joints.histogram()[std::size_t(j)].quantile(0.99), p99[j]);
  out["torque_p99"] = p99;
}

void put_feet(nb::dict& out, const SummaryTotals& totals) {
  const auto& sums = totals.sums_of_feet;
  out["normal_impulse"] = VectorXd(sums.col(0));
  out["impulse"] = RowMatrix(sums.middleCols(1, 3).matrix());
  out["slip_distance"] = VectorXd(sums.col(4));
  out["loaded_time"] = VectorXd(sums.col(5));
  out["friction_work"] = VectorXd(sums.col(6));
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
  out["height_rms"] = totals.heave.rms_about_mean();
  out["heave_rms"] = totals.heave.rms_about_line();
  out["roll_rate_rms"] = std::sqrt(totals.roll_rate_square / time);
  out["pitch_rate_rms"] = std::sqrt(totals.pitch_rate_square / time);
  out["roll_peak"] = totals.roll_peak.value;
  out["pitch_peak"] = totals.pitch_peak.value;
  out["vertical_acceleration_rms"] = std::sqrt(totals.acceleration_square / time);
}

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
  SummaryTotals& totals = summary.totals();
  nb::dict out;
  out["states"] = summary.states();
  out["cycles"] = summary.cycles();
  out["cycle_time"] = summary.period();
  out["window_time"] = totals.time;
  out["first_yaw"] = summary.first_yaw();
  const std::vector<PathPoint> path = summary.path();
  RowMatrix points(Eigen::Index(path.size()), 4);
  for (std::size_t k = 0; k < path.size(); ++k)
    points.row(Eigen::Index(k)) << path[k].time, path[k].x, path[k].y, path[k].yaw;
  out["path"] = points;
  put_peaks(out, "outside_torque", summary.outside_torque());
  put_peaks(out, "outside_force", summary.outside_force());
  if (totals.time <= 0.0) return out;  // no whole cycle
  put_joints(out, totals.joints, totals.time);
  put_peaks(out, "force_peak", totals.force_peak);
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
           "com"_a, "rubbing"_a = VectorXd(), "An accepted state; `rubbing`: friction powers of the feet, W.")
      .def("data", &summary_data, nb::sig("def data(self) -> dict[str, object]"),
           "Arrays and numbers by name; without peaks and means where no cycle is whole.");
}

}  // namespace hexapod
