#include <nanobind/nanobind.h>

#include "bindings/bindings.hpp"

NB_MODULE(_core, m) {
  m.doc() = "Inner loop of hexapod_pin: plant, contact, integrators, rollouts.";
  hexapod::bind_foot_control(m);
  hexapod::bind_kinematics(m);
  hexapod::bind_laws(m);
  hexapod::bind_terrain(m);
  hexapod::bind_plant(m);
  hexapod::bind_runs(m);
  hexapod::bind_summary(m);
}
