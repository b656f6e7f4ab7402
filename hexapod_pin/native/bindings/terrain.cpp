// Grounds, built from plain numbers.
#include <nanobind/nanobind.h>
#include <nanobind/eigen/dense.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.hpp"
#include "laws/terrain.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace hexapod {

namespace {

std::vector<std::pair<double, Vec3>> contacts(const Terrain& terrain, const Vec3& center,
                                              double radius) {
  GroundPoints points;
  const int count = terrain.find_contacts(center, radius, 0.0, points);
  std::vector<std::pair<double, Vec3>> out;
  for (int k = 0; k < count; ++k) out.emplace_back(points[k].gap, points[k].normal);
  return out;
}

}  // namespace

void bind_terrain(nb::module_& m) {
  nb::class_<Terrain>(m, "Terrain")
      .def("contacts", &contacts, "center"_a, "radius"_a, "[(gap, normal)] of a sphere at t = 0")
      .def("patch", nb::overload_cast<double, double>(&Terrain::patch_factors, nb::const_), "x"_a, "y"_a, "(friction factor, stiffness factor)");
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
}

}  // namespace hexapod
