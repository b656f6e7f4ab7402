// Foot control of many robots at a time: a row of numbers for each.
#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

#include "bindings/bindings.hpp"
#include "control/foot_control.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace hexapod {

namespace {

using ReadingRows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using ReadingBlocks = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using MemoryRows = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using LegRows = nb::ndarray<double, nb::shape<-1, kLegs, 12>, nb::c_contig, nb::device::cpu>;
constexpr std::size_t kTargetSize = 12;  // numbers of a leg's target
using StillFeet = nb::ndarray<const bool, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void append_rows(WalkTable& table, ReadingBlocks foot, ReadingBlocks velocity, StillFeet still, ReadingRows twist) {
  const std::size_t rows = foot.shape(0);
  if (velocity.shape(0) != rows || still.shape(0) != rows || twist.shape(0) != rows ||
      foot.shape(1) != kLegs || velocity.shape(1) != kLegs || still.shape(1) != kLegs ||
      foot.shape(2) != 3 || velocity.shape(2) != 3 || twist.shape(1) != 3)
    throw std::invalid_argument("a walk has rows of six feet and a twist");
  for (std::size_t k = 0; k < rows; ++k)
    table.append(foot.data() + 18 * k, velocity.data() + 18 * k, still.data() + kLegs * k, twist.data() + 3 * k);
}

// The six legs, link by link: axis, origin, mass, centre, inertia, armature, damping, dry friction.
LegChain leg_chain_of(const RowMatrix& links, const Vec3& foot) {
  if (links.rows() != 3 || links.cols() != 22) throw std::invalid_argument("three links of 22 numbers");
  std::array<LegLink, 3> out;
  for (int k = 0; k < 3; ++k) {
    const double* at = links.data() + 22 * k;
    const auto vec = [&](int from) { return Vec3(at[from], at[from + 1], at[from + 2]); };
    out[k] = {vec(0), vec(3), at[6], vec(7),
              Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(at + 10),
              at[19], at[20], at[21]};
  }
  return {out, foot};
}

// First number that is not finite: (field, place in the row), or (-1, 0).
using ReadingFault = std::pair<int, std::size_t>;

ReadingFault first_fault(const std::array<std::pair<const double*, std::size_t>, 7>& fields) {
  for (int f = 0; f < 7; ++f)
    for (std::size_t k = 0; k < fields[f].second; ++k)
      if (!std::isfinite(fields[f].first[k])) return {f, k};
  return {-1, 0};
}

std::pair<long, ReadingFault> update_rows(const FootControlLaw& law, const WalkTable& table, double time,
                                          ReadingRows q, ReadingRows v, ReadingRows torque,
                                          ReadingBlocks rotation, ReadingRows rate, ReadingRows acceleration,
                                          ReadingBlocks force, ReadingRows before, MemoryRows after,
                                          LegRows targets) {
  const std::size_t batch = q.shape(0), n = q.shape(1), points = 3 * force.shape(1);
  const bool fits = v.shape(0) == batch && torque.shape(0) == batch && rotation.shape(0) == batch &&
                    rate.shape(0) == batch && acceleration.shape(0) == batch && force.shape(0) == batch &&
                    before.shape(0) == batch && after.shape(0) == batch && targets.shape(0) == batch &&
                    v.shape(1) == n && torque.shape(1) == n && before.shape(1) == memory_size() &&
                    after.shape(1) == memory_size() && law.fits(n, force.shape(1)) &&
                    rotation.shape(1) == 3 && rotation.shape(2) == 3 && rate.shape(1) == 3 &&
                    acceleration.shape(1) == 3 && force.shape(2) == 3;
  if (!fits) throw std::invalid_argument("foot control: arrays of another shape");
  for (std::size_t b = 0; b < batch; ++b) {
    const Readings in{q.data() + b * n, v.data() + b * n, torque.data() + b * n, rotation.data() + 9 * b,
                      rate.data() + 3 * b, acceleration.data() + 3 * b, force.data() + points * b};
    const ReadingFault fault = first_fault({{{in.q, n}, {in.v, n}, {in.torque, n}, {in.rotation, 9}, {in.rate, 3},
                                      {in.acceleration, 3}, {in.foot_force, points}}});
    if (fault.first >= 0) return {long(b), fault};
    ControlMemory memory;
    const double* from = before.data() + b * memory_size();
    each_number(memory, [&](double& x) { x = *from++; });
    LegTargets found;
    law.update(table, time, in, memory, found);
    double* to = after.data() + b * memory_size();
    each_number(memory, [&](double& x) { *to++ = x; });
    double* at = targets.data() + kTargetSize * kLegs * b;
    for (const LegTarget& target : found)
      for (const Vec3& part : {target.foot, target.rate, target.offset, target.offset_rate})
        for (int k = 0; k < 3; ++k) *at++ = part[k];
  }
  return {-1, {-1, 0}};
}

void set_points(const FootControlLaw& law, LegRows targets, MemoryRows q, MemoryRows v) {
  const std::size_t batch = q.shape(0), n = q.shape(1);
  if (targets.shape(0) != batch || v.shape(0) != batch || v.shape(1) != n || !law.fits(n, SIZE_MAX))
    throw std::invalid_argument("foot control: arrays of another shape");
  for (std::size_t b = 0; b < batch; ++b) {
    LegTargets wanted;
    const double* at = targets.data() + kTargetSize * kLegs * b;
    for (LegTarget& target : wanted)
      for (Vec3* part : {&target.foot, &target.rate, &target.offset, &target.offset_rate})
        for (int k = 0; k < 3; ++k) (*part)[k] = *at++;
    law.set_points(wanted, q.data() + n * b, v.data() + n * b);
  }
}

void bind_control_settings(nb::module_& m) {
  nb::enum_<ForceSource>(m, "ForceSource")
      .value("foot", ForceSource::foot)
      .value("torque", ForceSource::torque)
      .value("current", ForceSource::current);
  nb::enum_<SlipSignal>(m, "SlipSignal")
      .value("none", SlipSignal::none)
      .value("force", SlipSignal::force)
      .value("slip", SlipSignal::slip);
  nb::class_<SlipGains>(m, "SlipGains")
      .def(nb::init<>())
      .def_rw("kp", &SlipGains::kp)
      .def_rw("ki", &SlipGains::ki)
      .def_rw("kd", &SlipGains::kd)
      .def_rw("derivative_time", &SlipGains::derivative_time)
      .def_rw("limit", &SlipGains::limit);
  nb::class_<SuspensionGains>(m, "SuspensionGains")
      .def(nb::init<>())
      .def_rw("mass", &SuspensionGains::mass)
      .def_rw("damping", &SuspensionGains::damping)
      .def_rw("stiffness", &SuspensionGains::stiffness)
      .def_rw("limit", &SuspensionGains::limit);
  nb::class_<TouchDownSettings>(m, "TouchDownSettings")
      .def(nb::init<>())
      .def_rw("reacts", &TouchDownSettings::reacts)
      .def_rw("earliest", &TouchDownSettings::earliest)
      .def_rw("search_speed", &TouchDownSettings::search_speed)
      .def_rw("search_depth", &TouchDownSettings::search_depth)
      .def_rw("rise_speed", &TouchDownSettings::rise_speed)
      .def_rw("rise_limit", &TouchDownSettings::rise_limit)
      .def_rw("retreat", &TouchDownSettings::retreat)
      .def_rw("patience", &TouchDownSettings::patience)
      .def_rw("lost_after", &TouchDownSettings::lost_after);
  nb::class_<LeastTorque>(m, "LeastTorque")
      .def(nb::init<>())
      .def_rw("cost", &LeastTorque::cost)
      .def_rw("damping", &LeastTorque::damping)
      .def_rw("friction", &LeastTorque::friction);
  nb::class_<FootControlSettings>(m, "FootControlSettings")
      .def(nb::init<>())
      .def_rw("period", &FootControlSettings::period)
      .def_rw("lead", &FootControlSettings::lead)
      .def_rw("source", &FootControlSettings::source)
      .def_rw("filter_time", &FootControlSettings::filter_time)
      .def_rw("threshold", &FootControlSettings::threshold)
      .def_rw("radius", &FootControlSettings::radius)
      .def_rw("lower", &FootControlSettings::lower)
      .def_rw("upper", &FootControlSettings::upper)
      .def_rw("max_rate", &FootControlSettings::max_rate)
      .def_rw("signal", &FootControlSettings::signal)
      .def_rw("slip", &FootControlSettings::slip)
      .def_rw("suspended", &FootControlSettings::suspended)
      .def_rw("suspension", &FootControlSettings::suspension)
      .def_rw("nominal_load", &FootControlSettings::nominal_load)
      .def_rw("weight", &FootControlSettings::weight)
      .def_rw("gravity", &FootControlSettings::gravity)
      .def_rw("trunk_moment", &FootControlSettings::trunk_moment)
      .def_rw("anticipates", &FootControlSettings::anticipates)
      .def_rw("give", &FootControlSettings::give)
      .def_rw("lag", &FootControlSettings::lag)
      .def_rw("targets", &FootControlSettings::targets)
      .def_rw("one_sided", &FootControlSettings::one_sided)
      .def_rw("least_torque", &FootControlSettings::least_torque)
      .def_rw("upright_time", &FootControlSettings::upright_time)
      .def_rw("sole_stiffness", &FootControlSettings::sole_stiffness)
      .def_rw("sole_exponent", &FootControlSettings::sole_exponent)
      .def_rw("sole_give", &FootControlSettings::sole_give)
      .def_rw("heave", &FootControlSettings::heave)
      .def_rw("tilt", &FootControlSettings::tilt)
      .def_rw("warp", &FootControlSettings::warp)
      .def_rw("load_time", &FootControlSettings::load_time)
      .def_rw("touch_down", &FootControlSettings::touch_down)
      .def_rw("follow_height", &FootControlSettings::follow_height)
      .def_rw("follow_tilt", &FootControlSettings::follow_tilt)
      .def_rw("level_rate", &FootControlSettings::level_rate)
      .def_rw("level_limit", &FootControlSettings::level_limit);
}

}  // namespace

void bind_foot_control(nb::module_& m) {
  bind_control_settings(m);
  nb::class_<WalkTable>(m, "WalkTable", "Six planned feet over time, and when each is down.")
      .def(nb::init<const std::array<double, kLegs>&, double, double, double, double>(), "phases"_a, "duty"_a,
           "cycle_time"_a, "spacing"_a, "repeat_from"_a)
      .def("append", &append_rows, "foot"_a, "velocity"_a, "still"_a, "twist"_a,
           "ReadingRows at the next times: feet (K, 6, 3) [m] and their velocities, feet that stay where they are "
           "(K, 6), the body's twist (K, 3).")
      .def_prop_ro("end", &WalkTable::end, "Time of the last row [s].")
      .def("at", [](const WalkTable& table, double time) {
        const WalkPlan plan = table.at(time);
        RowMatrix out(kLegs, 9);
        for (int l = 0; l < kLegs; ++l)
          out.row(l) << plan[l].foot.transpose(), plan[l].velocity.transpose(), double(plan[l].down),
              plan[l].share, plan[l].until_lift;
        return out;
      }, "time"_a, "Per leg: foot (3), velocity (3), down, share of the swing, time until lift-off. (6, 9).");
  nb::class_<LegChain>(m, "LegChain", "A leg of three joints with its masses.")
      .def("__init__", [](LegChain* self, const RowMatrix& links, const Vec3& foot) {
        new (self) LegChain(leg_chain_of(links, foot));
      }, "links"_a, "foot"_a)
      .def("foot_and_jacobian", [](const LegChain& leg, const Vec3& q) {
        const LegPose pose = leg.pose(q);
        return std::pair<Vec3, Mat3>(pose.foot, pose.jacobian);
      }, "q"_a)
      .def("own_torque", [](const LegChain& leg, const Vec3& q, const Vec3& v, const Vec3& a, const Vec3& rate,
                            const Vec3& acceleration) {
        return leg.own_torque(leg.pose(q), {rate, acceleration}, v, a);
      }, "q"_a, "v"_a, "a"_a, "rate"_a, "acceleration"_a);
  nb::class_<FootControlLaw>(m, "FootControlLaw", "Foot control of six legs, a row for each robot.")
      .def(nb::init<const FootControlSettings&, std::vector<LegChain>,
                    std::vector<std::array<std::size_t, 3>>, std::vector<std::size_t>>(),
           "settings"_a, "legs"_a, "joints"_a, "feet"_a)
      .def_static("memory_size", &memory_size)
      .def_static("first_memory", [] {
        ControlMemory memory;
        VectorXd row(memory_size());
        double* to = row.data();
        each_number(memory, [&](double& x) { *to++ = x; });
        return row;
      })
      .def_static("targets", [](const VectorXd& row) {
        if (std::size_t(row.size()) != memory_size()) throw std::invalid_argument("a memory of another size");
        ControlMemory memory;
        const double* from = row.data();
        each_number(memory, [&](double& x) { x = *from++; });
        RowMatrix out(kLegs, 3);
        for (int l = 0; l < kLegs; ++l) out.row(l) = memory.leg[l].target.transpose();
        return out;
      }, "memory"_a, "Forces that the feet are to carry (6, 3) [N], trunk axes.")
      .def("update", &update_rows, "table"_a, "time"_a, "q"_a, "v"_a, "torque"_a, "rotation"_a, "rate"_a,
           "acceleration"_a, "foot_force"_a, "before"_a, "after"_a, "targets"_a,
           "Targets of the feet, their rates, offsets of the joints and of their rates (B, 6, 12) [m, m/s, rad, "
           "rad/s], and the memory after a tick; (-1, ...), or the row, field and place of the first reading that is not finite.")
      .def("set_points", &set_points, "targets"_a, "q"_a, "v"_a,
           "Writes set-points and their rates (B, n) [rad, rad/s] for targets over the angles that put the feet "
           "there.");
  m.def("force_targets", [](const LeastTorque& settings, const RowMatrix& jacobians, const RowMatrix& arms,
                            const RowMatrix& own, const LegNumbers& weight, double load, const Vec3& up,
                            const Vec3& normal) {
    if (jacobians.rows() != 3 * kLegs || jacobians.cols() != 3 || arms.rows() != kLegs || arms.cols() != 3 ||
        own.rows() != kLegs || own.cols() != 3)
      throw std::invalid_argument("six legs of three joints");
    LegsStatics legs;
    for (int l = 0; l < kLegs; ++l)
      legs[l] = {jacobians.block<3, 3>(3 * l, 0), arms.row(l).transpose(), own.row(l).transpose()};
    const LegVectors force = force_targets(settings, legs, weight, load, up, normal);
    RowMatrix out(kLegs, 3);
    for (int l = 0; l < kLegs; ++l) out.row(l) = force[l].transpose();
    return out;
  }, "settings"_a, "jacobians"_a, "arms"_a, "own"_a, "weight"_a, "load"_a, "up"_a, "normal"_a,
     "Forces of six feet (6, 3) [N] from the Jacobians of their contact points (18, 3), these points from the "
     "centre of mass (6, 3) [m] and the legs' own torques (6, 3) [N m].");
}

}  // namespace hexapod
