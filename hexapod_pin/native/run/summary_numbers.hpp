// The numbers of a summary by name: each is named here, and once more in the class of the record that
// holds it in Python.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "run/summary.hpp"

namespace hexapod {

// Calls put(name, value) for each number that is known so far; a value is a double, a VectorXd with an
// entry per joint or foot, or a RowMatrix. Energies and what feet gather are per whole cycle, or of
// the whole window where nothing repeats. Without a whole cycle there are no means and no peaks.
template <class Put>
void for_each_number(RunSummary& summary, Put&& put) {
  SummaryTotals& totals = summary.totals();
  const double time = totals.time;
  const double cycles = double(std::max(1L, summary.cycles()));
  const auto put_peaks = [&](const std::string& name, const Peaks& peaks) {
    put(name, VectorXd(peaks.value));
    put(name + "_time", VectorXd(peaks.time));
  };
  const auto of_joints = [&](auto value) {
    const std::vector<JointSums>& sums = totals.joints.sums();
    VectorXd values(Eigen::Index(sums.size()));
    for (std::size_t j = 0; j < sums.size(); ++j) values[Eigen::Index(j)] = value(sums[j]);
    return values;
  };
  const auto of_feet = [&](Eigen::Index column) {
    return VectorXd(totals.sums_of_feet.col(column) / cycles);
  };
  const auto rms = [&](double square) { return std::sqrt(square / time); };

  const std::vector<PathPoint> path = summary.path();
  RowMatrix points(Eigen::Index(path.size()), 4);
  for (std::size_t k = 0; k < path.size(); ++k)
    points.row(Eigen::Index(k)) << path[k].time, path[k].x, path[k].y, path[k].yaw;
  put("path", points);
  put("window_time", time);
  put("first_yaw", summary.first_yaw());
  put_peaks("outside_torque", summary.outside_torque());
  put_peaks("outside_force", summary.outside_force());
  if (time <= 0.0) return;

  // Joints.
  put_peaks("torque_peak", totals.joints.peaks(&JointSums::torque));
  put_peaks("speed_peak", totals.joints.peaks(&JointSums::speed));
  put_peaks("power_peak", totals.joints.peaks(&JointSums::power));
  put("driving_power_peak", of_joints([](const JointSums& s) { return s.driving_power; }));
  put("braking_power_peak", of_joints([](const JointSums& s) { return s.braking_power; }));
  put("torque_rms", of_joints([&](const JointSums& s) { return rms(s.torque_square); }));
  put("speed_rms", of_joints([&](const JointSums& s) { return rms(s.rate_square); }));
  put("positive_energy", of_joints([&](const JointSums& s) { return s.positive_energy / cycles; }));
  put("negative_energy", of_joints([&](const JointSums& s) { return s.negative_energy / cycles; }));
  put("at_limit", of_joints([&](const JointSums& s) { return s.at_limit / time; }));
  put("limit_use", of_joints([](const JointSums& s) { return s.limit_use; }));
  put("acceleration_rms", VectorXd((totals.joints.acceleration_square / time).sqrt()));
  put("torque_acceleration", VectorXd(totals.joints.torque_acceleration / time));
  put("angle_min", of_joints([](const JointSums& s) { return s.lowest; }));
  put("angle_max", of_joints([](const JointSums& s) { return s.highest; }));
  VectorXd p99 = totals.joints.peaks(&JointSums::torque).size;  // the histogram's top bin ends above
  for (Eigen::Index j = 0; j < p99.size(); ++j)
    p99[j] = std::min(totals.joints.histogram()[std::size_t(j)].quantile(0.99), p99[j]);
  put("torque_p99", p99);

  // Feet.
  put_peaks("force_peak", totals.force_peak);
  put("normal_impulse", of_feet(0));
  put("impulse", RowMatrix((totals.sums_of_feet.middleCols(1, 3) / cycles).matrix()));
  put("slip_distance", of_feet(4));
  put("loaded_time", of_feet(5));
  put("friction_work", of_feet(6));

  // Trunk.
  put("height_min", totals.least_height);
  put("height_max", totals.most_height);
  put("height_mean", totals.height / time);
  put("height_rms", totals.heave.rms_about_mean());
  put("heave_rms", totals.heave.rms_about_line());
  put("roll_mean", totals.roll / time);
  put("roll_rms", rms(totals.roll_square));
  put("roll_peak", totals.roll_peak.value);
  put("pitch_mean", totals.pitch / time);
  put("pitch_rms", rms(totals.pitch_square));
  put("pitch_peak", totals.pitch_peak.value);
  put("roll_rate_rms", rms(totals.roll_rate_square));
  put("pitch_rate_rms", rms(totals.pitch_rate_square));
  put("vertical_acceleration_rms", rms(totals.acceleration_square));
}

}  // namespace hexapod
