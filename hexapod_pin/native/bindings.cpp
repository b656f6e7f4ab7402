// The border to Python: plain arrays in, plain arrays out. The interpreter is never held in a run.
#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include "batch.hpp"
#include "rollout.hpp"
#include "settings.hpp"
#include "stiff_block.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace hexapod;

namespace {

PlantSettings make_settings(const std::string& model, const Vec3& gravity,
                            const std::vector<std::tuple<std::size_t, Vec3, double>>& feet,
                            const NormalLaw& normal, const FrictionLaw& friction, const Terrain& terrain,
                            const VectorXd& kp, const VectorXd& kd, const VectorXd& limit,
                            const VectorXd& damping, const VectorXd& lower, const VectorXd& upper,
                            double stop_stiffness, double stop_dissipation, bool dense,
                            bool fused, bool baseline) {
  const DynamicsPath path = !fused     ? DynamicsPath::pinocchio
                            : baseline ? DynamicsPath::fused_baseline
                                       : DynamicsPath::fused;
  PlantSettings s{Dynamics(model, gravity, path), {}, {normal, friction}, terrain,
                  {kp, kd, limit, damping}, {lower, upper, stop_stiffness, stop_dissipation}, dense};
  const Tree& tree = s.dynamics.tree();
  for (const auto& [joint, offset, radius] : feet) {
    if (joint < 1 || joint >= std::size_t(tree.joints))
      throw std::invalid_argument("a foot names a joint that does not exist");
    s.mounts.push_back({joint, offset, radius});
  }
  for (const VectorXd* x : {&kp, &kd, &limit, &damping, &lower, &upper})
    if (x->size() != tree.nv - 6) throw std::invalid_argument("one servo entry per joint needed");
  return s;
}

std::vector<std::pair<double, Vec3>> contacts(const Terrain& terrain, const Vec3& center,
                                              double radius) {
  GroundPoints points;
  const int count = terrain.under(center, radius, 0.0, points);
  std::vector<std::pair<double, Vec3>> out;
  for (int k = 0; k < count; ++k) out.emplace_back(points[k].gap, points[k].normal);
  return out;
}

template <class PlantT>
nb::dict evaluation(PlantT plant, const VectorXd& q, const VectorXd& v, const VectorXd& torque) {
  plant.evaluate(0.0, q, v, 0.0);
  const int nv = plant.tree.nv, feet = int(plant.feet.size());
  Eigen::MatrixXd mass = plant.mass_upper().template selfadjointView<Eigen::Upper>();
  RowMatrix jacobian = RowMatrix::Zero(3 * feet, nv), drift = jacobian;
  RowMatrix force = RowMatrix::Zero(feet, 3), velocity = force, position = force, stiffness = force;
  RowMatrix damping = RowMatrix::Zero(3 * feet, 3);
  VectorXd gap(feet), column(nv), acceleration(nv);
  for (int i = 0; i < feet; ++i) {
    const auto& foot = plant.feet[i];
    gap[i] = foot.ground.gap;
    position.row(i) = (q.head<3>() + foot.center).transpose();
    if (!foot.active) continue;
    force.row(i) = foot.contact.force.transpose();
    velocity.row(i) = foot.velocity.transpose();
    damping.middleRows(3 * i, 3) = foot.contact.minus_du;
    stiffness.row(i) = foot.contact.minus_dz.transpose();
    for (int k = 0; k < 3; ++k) {
      column.setZero();
      plant.add_transposed(i, Vec3::Unit(k), column);
      jacobian.row(3 * i + k) = column.transpose();
    }
    for (int k = 0; k < nv; ++k)
      drift.block(3 * i, k, 3, 1) = plant.along(i, foot.qb, foot.ql, VectorXd::Unit(nv, k));
  }
  plant.acceleration(v, torque, acceleration);
  RowMatrix axis(nv - 6, 3), origin(nv - 6, 3);
  for (int j = 0; j < nv - 6; ++j) {
    axis.row(j) = plant.dynamics.axis(j + 2).transpose();
    origin.row(j) = plant.dynamics.origin(j + 2).transpose();
  }
  nb::dict out;
  out["joint_axis"] = axis;
  out["joint_origin"] = origin;  // from the base's origin
  out["mass"] = mass;
  out["bias"] = VectorXd(plant.bias());
  out["foot_jacobian"] = jacobian;
  out["foot_drift"] = drift;
  out["foot_force"] = force;
  out["foot_velocity"] = velocity;
  out["foot_position"] = position;
  out["foot_gap"] = gap;
  out["foot_damping"] = damping;
  out["foot_stiffness"] = stiffness;
  out["acceleration"] = acceleration;
  out["com"] = Vec3(q.head<3>() + plant.center_of_mass());
  return out;
}

nb::dict evaluate(const PlantSettings& s, const VectorXd& q, const VectorXd& v, const VectorXd& torque) {
  return s.arrow() ? evaluation(s.make<ArrowSystem>(), q, v, torque)
                   : evaluation(s.make<DenseSystem>(), q, v, torque);
}

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
    throw std::invalid_argument("state of the wrong size");
  const Eigen::Index contacts = Eigen::Index(s.mounts.size()) * s.terrain.most();
  if (from.contacts.rows() != 0 && (from.contacts.rows() != contacts || from.contacts.cols() != 6))
    throw std::invalid_argument("contact memories of the wrong size");
  const auto rows = Eigen::Index(time.size()), columns = Eigen::Index(tree.nv - 6);
  if (rows < 1 || position.rows() != rows || rate.rows() != rows || position.cols() != columns ||
      rate.cols() != columns)
    throw std::invalid_argument("set-points of the wrong size");
  return start_run(method, {s, Reference(time, position, rate, held), from, step, stride, sample,
                            accuracy});
}

nb::dict record(const Rollout& rollout) {
  nb::dict out;
  const auto channels = rollout.record().channels();
  const std::size_t rows = channels.front().second->values.size();  // one time per sample
  for (const auto& [name, channel] : channels) {
    if (channel->values.size() != rows * channel->width) throw std::logic_error("ragged record: " + name);
    auto* copy = new std::vector<double>(channel->values);
    nb::capsule owner(copy, [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
    out[name.c_str()] =
        nb::ndarray<nb::numpy, double>(copy->data(), {rows, channel->width}, owner);
  }
  return out;
}

}  // namespace

NB_MODULE(_core, m) {
  m.doc() = "Inner loop of hexapod_pin: plant, contact, integrators, rollouts.";

  nb::enum_<NormalKind>(m, "NormalKind")
      .value("hunt_crossley", NormalKind::hunt_crossley)
      .value("restitution", NormalKind::restitution)
      .value("kelvin_voigt", NormalKind::kelvin_voigt)
      .value("adams_impact", NormalKind::adams_impact);
  nb::class_<NormalLaw>(m, "NormalLaw")
      .def(nb::init<>())
      .def_rw("kind", &NormalLaw::kind)
      .def_rw("stiffness", &NormalLaw::stiffness)
      .def_rw("exponent", &NormalLaw::exponent)
      .def_rw("dissipation", &NormalLaw::dissipation)
      .def_rw("eta", &NormalLaw::eta)
      .def_rw("speed_floor", &NormalLaw::speed_floor)
      .def_rw("damping", &NormalLaw::damping)
      .def_rw("damping_depth", &NormalLaw::damping_depth)
      .def("energy", &NormalLaw::energy, "depth"_a)
      .def("__call__", [](const NormalLaw& law, double depth, double rate, double touch) {
        const NormalForce f = law(depth, rate, touch);
        return std::make_tuple(f.force, f.d_depth, f.d_rate, f.elastic);
      }, "depth"_a, "rate"_a, "touch_speed"_a = 0.0, "(force, dF/ddepth, dF/drate, elastic part)");

  nb::enum_<FrictionKind>(m, "FrictionKind")
      .value("none", FrictionKind::none)
      .value("tanh_coulomb", FrictionKind::tanh_coulomb)
      .value("adams_coulomb", FrictionKind::adams_coulomb)
      .value("smooth_step", FrictionKind::smooth_step)
      .value("brown_mcphee", FrictionKind::brown_mcphee)
      .value("bristle", FrictionKind::bristle);
  nb::class_<FrictionLaw>(m, "FrictionLaw")
      .def(nb::init<>())
      .def_rw("kind", &FrictionLaw::kind)
      .def_rw("mu", &FrictionLaw::mu)
      .def_rw("slip_slope", &FrictionLaw::slip_slope)
      .def_rw("mu_dynamic", &FrictionLaw::mu_dynamic)
      .def_rw("stiction_speed", &FrictionLaw::stiction_speed)
      .def_rw("transition_speed", &FrictionLaw::transition_speed)
      .def_rw("bristle_stiffness", &FrictionLaw::bristle_stiffness)
      .def_rw("bristle_damping", &FrictionLaw::bristle_damping)
      .def("__call__", [](const FrictionLaw& law, double speed) {
        const FrictionFactor f = law(speed);
        return std::make_tuple(f.ratio, f.slope);
      }, "speed"_a, "(m/s, (d(m/s)/ds)/s) at slip speed s");

  nb::class_<Terrain>(m, "Terrain")
      .def("contacts", &contacts, "center"_a, "radius"_a, "[(gap, normal)] of a sphere at t = 0")
      .def("patch", &Terrain::factors, "x"_a, "y"_a, "(friction factor, stiffness factor)");
  m.def("plane", [](const Vec3& point, const Vec3& normal) {
    return Terrain{Plane{point, normal.normalized()}};
  }, "point"_a, "normal"_a);
  m.def("profile", [](double heading, const std::vector<double>& x, const std::vector<double>& z) {
    return Terrain{Profile(heading, x, z)};
  }, "heading"_a, "x"_a, "z"_a);
  m.def("height_field", [](double x0, double y0, double dx, double dy, const RowMatrix& z) {
    std::vector<double> values(z.data(), z.data() + z.size());
    return Terrain{HeightField(x0, y0, dx, dy, int(z.cols()), int(z.rows()), std::move(values))};
  }, "x0"_a, "y0"_a, "dx"_a, "dy"_a, "z"_a);
  m.def("with_patches", [](Terrain terrain, const std::vector<std::array<double, 6>>& patches) {
    for (const auto& p : patches) terrain.patches.push_back({p[0], p[1], p[2], p[3], p[4], p[5]});
    return terrain;
  }, "terrain"_a, "patches"_a);
  m.def("with_shaking", [](Terrain terrain, double amplitude, double frequency) {
    terrain.amplitude = amplitude;
    terrain.rate = 2.0 * M_PI * frequency;
    return terrain;
  }, "terrain"_a, "amplitude"_a, "frequency"_a);

  nb::class_<PlantSettings>(m, "PlantSettings")
      .def_prop_ro("arrow", &PlantSettings::arrow, "true: block-arrow LU; false: dense LU")
      .def_prop_ro("dynamics", [](const PlantSettings& s) { return s.dynamics.path(); },
                   "who computes: fused avx2, fused or pinocchio");
  m.def("plant_settings", &make_settings, "model"_a, "gravity"_a, "feet"_a, "normal"_a, "friction"_a,
        "terrain"_a, "kp"_a, "kd"_a, "limit"_a, "damping"_a, "lower"_a, "upper"_a, "stop_stiffness"_a, "stop_dissipation"_a, "dense"_a = false,
        "fused"_a = true, "baseline"_a = false);
  m.def("evaluate", &evaluate, "plant"_a, "q"_a, "v"_a, "torque"_a,
        "Dynamics and feet of one state; joint torques given.");
  m.def("chart_rates", [](const PlantSettings& s, const VectorXd& q0, const VectorXd& y,
                          const VectorXd& q_ref, double step, const VectorXd& b) {
    const ChartRates rates = chart_rates(s, q0, y, q_ref, step, b);
    return std::make_pair(rates.slope, rates.solution);
  }, "plant"_a, "q0"_a, "y"_a, "q_ref"_a, "s"_a, "b"_a,
        "y' in the chart of q0, y = (xi, v, z), and (I - sJ)^-1 b with the stiff block of NDF.");

  m.def("repeat_compute", [](const PlantSettings& s, const VectorXd& q, const VectorXd& v, long count) {
    Dynamics dynamics = s.dynamics;
    double sum = 0.0;
    for (long k = 0; k < count; ++k) {
      dynamics.compute(q, v);
      sum += dynamics.bias()[0];
    }
    return sum;
  }, "plant"_a, "q"_a, "v"_a, "count"_a,
        nb::call_guard<nb::gil_scoped_release>(),
        "Runs the plant's own dynamics of one evaluation `count` times, for benchmarks.");
  m.def("repeat_dynamics", [](const PlantSettings& s, const VectorXd& q, const VectorXd& v, long count) {
    return s.dynamics.repeat(q, v, count);
  }, "plant"_a, "q"_a, "v"_a, "count"_a,
        nb::call_guard<nb::gil_scoped_release>(),
        "Runs the Pinocchio calls of one evaluation `count` times, for benchmarks.");

  nb::class_<Rollout>(m, "Rollout")
      .def("advance", &Rollout::advance, "samples"_a, nb::call_guard<nb::gil_scoped_release>())
      .def("record", &record)
      .def("counters", &Rollout::counters)
      .def("checkpoint", &Rollout::checkpoint);
  nb::class_<Checkpoint>(m, "Checkpoint")
      .def_ro("first", &Checkpoint::first)
      .def_ro("q", &Checkpoint::q)
      .def_ro("v", &Checkpoint::v)
      .def_ro("contacts", &Checkpoint::contacts)
      .def_ro("controller", &Checkpoint::controller);
  m.def("checkpoint", &make_checkpoint, "first"_a, "q"_a, "v"_a, "contacts"_a, "controller"_a);
  m.def("start", &start, "plant"_a, "time"_a, "position"_a, "rate"_a, "held"_a, "start"_a, "method"_a,
        "step"_a, "stride"_a, "sample"_a, "accuracy"_a);
  m.def("advance_all", &advance_all, "rollouts"_a, "samples"_a, "threads"_a,
        nb::call_guard<nb::gil_scoped_release>());
}
