// Inverse kinematics of legs, many robots at a time.
#include <nanobind/nanobind.h>
#include <nanobind/eigen/dense.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "bindings/bindings.hpp"
#include "kinematics/leg_inverse.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace hexapod {

namespace {

// Of the legs of one robot: where each has its joints in a row of angles.
class LegsInverse {
 public:
  void add(const LegInverse& leg, const std::array<std::size_t, 3>& joints) {
    legs_.emplace_back(leg, joints);
  }

  using Feet = nb::ndarray<const double, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;
  using Rows = nb::ndarray<double, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;

  // feet (B, L, 3), rows (B, n): angles to be nearest to, by whole turns; the legs' are replaced.
  bool solve(Feet feet, Rows rows) const {
    if (feet.shape(0) != rows.shape(0) || feet.shape(1) != legs_.size())
      throw std::invalid_argument("feet must be (rows, legs, 3)");
    const std::size_t width = rows.shape(1);
    for (const auto& [leg, joints] : legs_)
      for (const std::size_t j : joints)
        if (j >= width) throw std::invalid_argument("a joint of a leg is not in the rows");
    const double* target = feet.data();
    for (std::size_t b = 0; b < rows.shape(0); ++b) {
      double* row = rows.data() + b * width;
      for (const auto& [leg, joints] : legs_) {
        Vec3 q(row[joints[0]], row[joints[1]], row[joints[2]]);
        if (!leg.solve(Vec3(target[0], target[1], target[2]), q)) return false;
        for (int k = 0; k < 3; ++k) row[joints[k]] = q[k];
        target += 3;
      }
    }
    return true;
  }

 private:
  std::vector<std::pair<LegInverse, std::array<std::size_t, 3>>> legs_;
};

}  // namespace

void bind_kinematics(nb::module_& m) {
  nb::class_<LegsInverse>(m, "LegsInverse", "Closed-form inverse kinematics of yaw-pitch-pitch legs.")
      .def(nb::init<>())
      .def("add",
           [](LegsInverse& legs, const Mat3& hip_axes, const Vec3& hip, const Vec3& lengths,
              const Vec3& sign, const Vec3& offset, double fold, double knee, double tolerance,
              const Vec3& lower, const Vec3& upper, const std::array<std::size_t, 3>& joints) {
             legs.add({hip_axes, hip, lengths, sign, offset, fold, knee, tolerance, lower, upper},
                      joints);
           },
           "hip_axes"_a, "hip"_a, "lengths"_a, "sign"_a, "offset"_a, "fold"_a, "knee"_a,
           "tolerance"_a, "lower"_a, "upper"_a, "joints"_a, "The next leg and its joints.")
      .def("solve", &LegsInverse::solve, "feet"_a, "rows"_a,
           "Angles of feet (B, L, 3) [m] into rows (B, n) [rad], by whole turns nearest to what these "
           "hold. False: a leg cannot; the rows are not to be used.");
}

}  // namespace hexapod
