// The fused pass for a tree of bodies: takes their numbers once, in the axes it wants.
#pragma once

#include <array>
#include <vector>

#include "fused/fused_legs.hpp"
#include "plant/tree.hpp"

namespace hexapod {

class FusedDynamics {
 public:
  // One to eight legs of three revolute joints. Anything else: Pinocchio's.
  static bool fits(const TreeModel& model);

  // gravity in world axes, m/s^2
  FusedDynamics(const TreeModel& model, const Vec3& gravity, bool baseline);

  bool avx2() const { return pass_ == fused::kAvx2Build; }

  // As `Dynamics::compute`, into these places.
  void compute(const VectorXd& q, const VectorXd& v, Eigen::MatrixXd& mass_upper, VectorXd& bias,
               Mat3& base_rotation, std::vector<Vec3>& axis, std::vector<Vec3>& origin) {
    pass_(robot_, q.data() + 3, v.data(),
          {mass_upper.data(), bias.data(), base_rotation.data(), axis[2].data(), origin[2].data(),
           first_moment_.data(), rotation_.data()});
  }

  Mat3 rotation(std::size_t joint) const;  // of a joint's body to base axes
  Vec3 center_of_mass() const { return first_moment_ / robot_.total_mass; }  // base axes

 private:
  void take_base(const TreeModel& model);
  void take_joint(std::size_t joint, const TreeModel& model);

  fused::Robot robot_;
  fused::Pass pass_;
  std::array<fused::PerLeg[9], 3> rotation_ = {};
  Vec3 first_moment_ = Vec3::Zero();
  std::vector<Mat3> align_;  // to the axes of the pass, of each joint's body
};

}  // namespace hexapod
