// The bindings to Python, one unit per concern: plain arrays in, plain arrays out.
#pragma once

#include <nanobind/nanobind.h>

namespace hexapod {

void bind_laws(nanobind::module_& m);
void bind_terrain(nanobind::module_& m);
void bind_plant(nanobind::module_& m);
void bind_runs(nanobind::module_& m);

}  // namespace hexapod
