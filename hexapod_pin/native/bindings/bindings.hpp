// The bindings to Python, one unit per concern: plain arrays in, plain arrays out.
#pragma once

#include <nanobind/nanobind.h>

namespace hexapod {

class RunSummary;

void bind_foot_control(nanobind::module_& m);
void bind_kinematics(nanobind::module_& m);
void bind_laws(nanobind::module_& m);
void bind_terrain(nanobind::module_& m);
void bind_plant(nanobind::module_& m);
void bind_runs(nanobind::module_& m);
void bind_batch(nanobind::module_& m);
void bind_summary(nanobind::module_& m);

// A summary as a dictionary of arrays and numbers.
nanobind::dict summary_data(RunSummary& summary);

}  // namespace hexapod
