// The contact laws, to look at from Python.
#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>

#include "bindings/bindings.hpp"
#include "laws/drive.hpp"
#include "laws/friction.hpp"
#include "laws/normal.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace hexapod {

namespace {

DriveLaw make_drive(const VectorXd& kp, const VectorXd& kd, const VectorXd& cap,
                    const VectorXd& line_torque, const VectorXd& line_slope, const VectorXd& damping,
                    const VectorXd& friction, const VectorXd& lower, const VectorXd& upper,
                    const VectorXd& stop_stiffness, double stop_dissipation,
                    const std::vector<GearFriction>& gear) {
  for (const VectorXd* x : {&kd, &cap, &line_torque, &line_slope, &damping, &friction, &lower, &upper,
                            &stop_stiffness})
    if (x->size() != kp.size()) throw std::invalid_argument("one drive entry per joint needed");
  if (!gear.empty() && Eigen::Index(gear.size()) != kp.size())
    throw std::invalid_argument("one gear per joint, or none, needed");
  return {kp, kd, cap, line_torque, line_slope, damping, friction,
          {lower, upper, stop_stiffness, stop_dissipation}, gear};
}

void bind_drive(nb::module_& m) {
  nb::enum_<LimitMode>(m, "LimitMode")
      .value("lower_line", LimitMode::lower_line)
      .value("lower_cap", LimitMode::lower_cap)
      .value("within", LimitMode::within)
      .value("upper_cap", LimitMode::upper_cap)
      .value("upper_line", LimitMode::upper_line);
  nb::enum_<StopMode>(m, "StopMode")
      .value("lower_released", StopMode::lower_released)
      .value("lower", StopMode::lower)
      .value("free", StopMode::free)
      .value("upper", StopMode::upper)
      .value("upper_released", StopMode::upper_released);
  nb::enum_<FrictionMode>(m, "FrictionMode")
      .value("none", FrictionMode::none)
      .value("stuck", FrictionMode::stuck)
      .value("forward", FrictionMode::forward)
      .value("backward", FrictionMode::backward);
  nb::class_<DriveMode>(m, "DriveMode")
      .def(nb::init<>())
      .def_rw("limit", &DriveMode::limit)
      .def_rw("stop", &DriveMode::stop)
      .def_rw("friction", &DriveMode::friction);
  const auto response = [](const GearResponse& r) {
    return std::make_tuple(r.friction, r.per_torque, r.per_speed);
  };
  nb::class_<GearFriction>(m, "GearFriction")
      .def(nb::init<>())
      .def_rw("coulomb", &GearFriction::coulomb)
      .def_rw("stribeck", &GearFriction::stribeck)
      .def_rw("motor", &GearFriction::motor)
      .def_rw("load", &GearFriction::load)
      .def_rw("motor_stribeck", &GearFriction::motor_stribeck)
      .def_rw("load_stribeck", &GearFriction::load_stribeck)
      .def_rw("motor_quadratic", &GearFriction::motor_quadratic)
      .def_rw("load_quadratic", &GearFriction::load_quadratic)
      .def_rw("stribeck_speed", &GearFriction::stribeck_speed)
      .def_rw("stribeck_exponent", &GearFriction::stribeck_exponent)
      .def_rw("viscous", &GearFriction::viscous)
      .def_rw("external_load", &GearFriction::external_load)
      .def("under_motor", [response](const GearFriction& gear, double torque, double speed) {
        return response(gear.under_motor(torque, speed));
      }, "torque"_a, "speed"_a, "(F, dF/dtorque, dF/dspeed) under a motor torque along the motion")
      .def("under_load", [response](const GearFriction& gear, double torque, double speed) {
        return response(gear.under_load(torque, speed));
      }, "torque"_a, "speed"_a, "(F, dF/dtorque, dF/dspeed) under a load along the motion")
      .def("under_both", [](const GearFriction& gear, double torque, double load, double speed) {
        const GearResponse r = gear.under_both(torque, load, speed);
        return std::make_tuple(r.friction, r.per_torque, r.per_load, r.per_speed);
      }, "torque"_a, "load"_a, "speed"_a,
           "(F, dF/dtorque, dF/dload, dF/dspeed) under a motor torque and an external load along the motion");
  nb::class_<DriveLaw>(m, "DriveLaw")
      .def("demand", &DriveLaw::demand, "joint"_a, "error"_a, "rate_error"_a, "torque_ref"_a)
      .def("motor_torque", &DriveLaw::motor_torque, "joint"_a, "demand"_a, "rate"_a)
      .def("mode", &DriveLaw::mode, "joint"_a, "angle"_a, "rate"_a, "demand"_a)
      .def("torque", [](const DriveLaw& law, int joint, const DriveMode& mode, double angle, double rate,
                        double demand, double external) {
        const DriveTorque t = law.torque(joint, mode, angle, rate, demand, external);
        return std::make_tuple(t.torque, t.stiffness, t.damping);
      }, "joint"_a, "mode"_a, "angle"_a, "rate"_a, "demand"_a, "external"_a = 0.0,
           "(torque, -d/dangle, -d/drate) in a mode")
      .def("switches", &DriveLaw::switches, "joint"_a, "mode"_a, "angle"_a, "rate"_a, "demand"_a,
           "holding"_a, "external"_a = 0.0, "Above zero inside the mode.")
      .def("resistance_to", &DriveLaw::resistance_to, "joint"_a, "left"_a, "rate"_a, "external"_a = 0.0,
           "What friction and damping take of the motor's torque, given what is left of it.");
  m.def("drive_law", &make_drive, "kp"_a, "kd"_a, "cap"_a, "line_torque"_a, "line_slope"_a, "damping"_a,
        "friction"_a, "lower"_a, "upper"_a, "stop_stiffness"_a, "stop_dissipation"_a,
        "gear"_a = std::vector<GearFriction>(),
        "Drives of all joints, an entry for each.");
}

}  // namespace

void bind_laws(nb::module_& m) {
  bind_drive(m);
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
}

}  // namespace hexapod
