// The plant: its settings, its evaluation at one state, and what the tests and benchmarks ask of it.
#include <nanobind/nanobind.h>
#include <nanobind/eigen/dense.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.hpp"
#include "methods/chart_rates.hpp"
#include "plant/settings.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace hexapod {

namespace {

using RowMat3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Rows of the arrays: joints 1 (the base), 2, ...; joints are counted as Pinocchio does.
TreeModel make_tree(const std::vector<std::size_t>& parent, const RowMatrix& motion,
                    const RowMatrix& placement, const RowMatrix& inertia,
                    const VectorXd& armature) {
  const Eigen::Index count = Eigen::Index(parent.size());
  if (motion.rows() != count || motion.cols() != 6 || placement.rows() != count ||
      placement.cols() != 12 || inertia.rows() != count || inertia.cols() != 13)
    throw std::invalid_argument("one row of motion, placement and inertia per joint needed");
  std::vector<std::size_t> parents{0};
  parents.insert(parents.end(), parent.begin(), parent.end());
  std::vector<TreeBody> bodies(1);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double *p = placement.row(i).data(), *y = inertia.row(i).data();
    bodies.push_back({motion.row(i).transpose(), RowMat3::Map(p), Vec3::Map(p + 9), y[0],
                      Vec3::Map(y + 1), RowMat3::Map(y + 4)});
  }
  return {parents, std::move(bodies), armature};
}

PlantSettings make_settings(const TreeModel& model, const Vec3& gravity,
                            const std::vector<std::tuple<std::size_t, Vec3, double>>& feet,
                            const NormalLaw& normal, const FrictionLaw& friction, const Terrain& terrain,
                            const DriveLaw& drive,
                            const std::vector<std::tuple<std::size_t, Vec3, Vec3, Vec3, double, double>>& pushes,
                            const std::vector<std::pair<int, double>>& lost, bool dense,
                            bool fused, bool baseline, bool prescribed) {
  const DynamicsPath path = !fused     ? DynamicsPath::pinocchio
                            : baseline ? DynamicsPath::fused_baseline
                                       : DynamicsPath::fused;
  PlantSettings s{Dynamics(model, gravity, path), {}, {normal, friction}, terrain,
                  drive, {}, dense, prescribed};
  const Tree& tree = s.dynamics.tree();
  for (const auto& [joint, offset, radius] : feet) {
    if (joint < 1 || joint >= std::size_t(tree.joints))
      throw std::invalid_argument("a foot names a joint that does not exist");
    s.mounts.push_back({joint, offset, radius});
  }
  for (const auto& [joint, offset, force, torque, begin, end] : pushes) {
    if (joint < 1 || joint >= std::size_t(tree.joints))
      throw std::invalid_argument("a push names a joint that does not exist");
    s.loads.pushes.push_back({joint, offset, force, torque, begin, end});
  }
  for (const auto& [joint, time] : lost) {
    if (joint < 0 || joint >= tree.nv - 6)
      throw std::invalid_argument("a lost drive names a joint that does not exist");
    s.loads.lost.push_back({joint, time});
  }
  if (drive.joints() != tree.nv - 6) throw std::invalid_argument("one drive entry per joint needed");
  return s;
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
      plant.add_jacobian_transposed(i, Vec3::Unit(k), column);
      jacobian.row(3 * i + k) = column.transpose();
    }
    for (int k = 0; k < nv; ++k)
      drift.block(3 * i, k, 3, 1) = plant.jacobian_times(i, foot.qb, foot.ql, VectorXd::Unit(nv, k));
  }
  for (int j = 0; j < nv - 6; ++j) plant.mode[j].friction = plant.drive.sliding(j, v[6 + j]);
  plant.find_slipping(v, torque, acceleration);
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
  if (s.prescribed) throw std::invalid_argument("joints that follow a motion take no torques");
  return s.with_plant([&](auto plant) { return evaluation(std::move(plant), q, v, torque); });
}

}  // namespace

void bind_plant(nb::module_& m) {
  nb::class_<TreeModel>(m, "TreeModel");
  m.def("tree_model", &make_tree, "parent"_a, "motion"_a, "placement"_a, "inertia"_a, "armature"_a,
        "Bodies and joints; rows as `plant.native_model` fills them.");
  nb::class_<PlantSettings>(m, "PlantSettings")
      .def_prop_ro("arrow", &PlantSettings::arrow, "true: block-arrow LU; false: dense LU")
      .def_prop_ro("dynamics", [](const PlantSettings& s) { return s.dynamics.path(); },
                   "dynamics backend: fused avx2, fused or pinocchio");
  m.def("plant_settings", &make_settings, "model"_a, "gravity"_a, "feet"_a, "normal"_a, "friction"_a,
        "terrain"_a, "drive"_a, "pushes"_a, "lost"_a, "dense"_a = false,
        "fused"_a = true, "baseline"_a = false, "prescribed"_a = false);
  m.def("evaluate", &evaluate, "plant"_a, "q"_a, "v"_a, "torque"_a,
        nb::sig("def evaluate(plant: PlantSettings, q: numpy.ndarray[dtype=float64], "
                "v: numpy.ndarray[dtype=float64], torque: numpy.ndarray[dtype=float64]) "
                "-> dict[str, numpy.ndarray[dtype=float64]]"),
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
}

}  // namespace hexapod
