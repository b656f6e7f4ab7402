// The contact laws, to look at from Python.
#include <nanobind/nanobind.h>
#include <nanobind/stl/tuple.h>

#include "bindings/bindings.hpp"
#include "laws/friction.hpp"
#include "laws/normal.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace hexapod {

void bind_laws(nb::module_& m) {
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
