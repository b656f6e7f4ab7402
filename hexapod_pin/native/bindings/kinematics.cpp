// Inverse kinematics of legs: in closed form, many robots at a time, and by search.
#include <nanobind/nanobind.h>
#include <nanobind/eigen/dense.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cstddef>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "bindings/bindings.hpp"
#include "kinematics/leg_inverse.hpp"
#include "kinematics/leg_search.hpp"

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

// A search for the angles of a leg of two or of three joints.
class AnyLegSearch {
 public:
  using Targets = LegSearch<3>::Targets;
  using Found = std::tuple<RowMatrix, Eigen::Index, double>;

  // A row per joint, and per direction of the task.
  AnyLegSearch(const RowMatrix& axes, const RowMatrix& origins, const Vec3& foot, const RowMatrix& task,
               const VectorXd& lower, const VectorXd& upper, double tolerance)
      : search_(axes.rows() == 2 ? Search(of<2>(axes, origins, foot, task, lower, upper, tolerance))
                                 : Search(of<3>(axes, origins, foot, task, lower, upper, tolerance))) {}

  Found follow(const Targets& targets, const VectorXd& near, bool limited) const {
    return std::visit([&](const auto& search) {
      require(near.size() == search.kJoints && near.allFinite());
      return found(search.follow(targets, near, limited));
    }, search_);
  }

  Found each(const Targets& targets, const RowMatrix& near, bool limited) const {
    return std::visit([&](const auto& search) {
      require(near.cols() == search.kJoints && near.rows() == targets.rows() && near.allFinite());
      return found(search.each(targets, near, limited));
    }, search_);
  }

  VectorXd distances(const Targets& targets, const VectorXd& near) const {
    return std::visit([&](const auto& search) {
      require(near.size() == search.kJoints && near.allFinite());
      return search.distances(targets, near);
    }, search_);
  }

 private:
  using Search = std::variant<LegSearch<2>, LegSearch<3>>;

  static void require(bool fits) {
    if (!fits) throw std::invalid_argument("a leg of two or three joints takes finite angles of its joints");
  }

  static Found found(FoundAngles&& angles) {
    return {std::move(angles.q), angles.missed, angles.distance};
  }

  template <int J>
  static LegSearch<J> of(const RowMatrix& axes, const RowMatrix& origins, const Vec3& foot,
                         const RowMatrix& task, const VectorXd& lower, const VectorXd& upper,
                         double tolerance) {
    for (const RowMatrix* rows : {&axes, &origins, &task}) require(rows->rows() == J && rows->cols() == 3);
    require(lower.size() == J && upper.size() == J);
    RevoluteChain<J> chain;
    for (int k = 0; k < J; ++k) chain.axis[k] = axes.row(k), chain.origin[k] = origins.row(k);
    chain.foot = foot;
    return {chain, task, lower, upper, tolerance};
  }

  Search search_;
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
  nb::class_<AnyLegSearch>(m, "LegSearch", "Inverse kinematics of a leg of any shape, two or three joints.")
      .def(nb::init<const RowMatrix&, const RowMatrix&, const Vec3&, const RowMatrix&, const VectorXd&,
                    const VectorXd&, double>(),
           "axes"_a, "origins"_a, "foot"_a, "task"_a, "lower"_a, "upper"_a, "tolerance"_a)
      .def("follow", &AnyLegSearch::follow, nb::call_guard<nb::gil_scoped_release>(), "targets"_a, "near"_a,
           "limited"_a, "Angles (N, J) [rad] along a path of targets (N, 3) [m], near (J,) at first; the first "
           "target that nothing reaches, or -1; and its distance [m].")
      .def("each", &AnyLegSearch::each, nb::call_guard<nb::gil_scoped_release>(), "targets"_a, "near"_a,
           "limited"_a, "The same of unrelated targets, near (N, J).")
      .def("distances", &AnyLegSearch::distances, nb::call_guard<nb::gil_scoped_release>(), "targets"_a,
           "near"_a, "How far the foot stays away from targets (N, 3), joint limits aside [m].");
}

}  // namespace hexapod
