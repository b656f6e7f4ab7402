// Velocity and Jacobians of one contact from the tree's kinematics.
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "plant/contact_state.hpp"
#include "plant/dynamics.hpp"
#include "plant/mount.hpp"

namespace hexapod {

// J: velocity of the contact point; Q: its derivative to the chart coordinates, with the point of
// contact staying below the centre while the link turns. `joints`: columns of the leg Jacobian.
template <class LegJacobian>
void differentiate_contact(const Dynamics& dynamics, const FootMount& mount,
                           const std::vector<std::size_t>& joints, const VectorXd& v,
                           const Vec3& ground_velocity, ContactState<LegJacobian>& foot) {
  const Vec3 arm = -mount.radius * foot.ground.normal;
  const Mat3& rotation = dynamics.base_rotation();
  const Vec3 point = foot.center + arm;
  Vec3 spin = rotation * v.template segment<3>(3);
  Vec3 at_center = rotation * v.template head<3>() + spin.cross(foot.center);
  for (int k = 0; k < 3; ++k) {
    foot.jb.col(k) = rotation.col(k);
    foot.jb.col(3 + k) = rotation.col(k).cross(point);
  }
  for (std::size_t k = 0; k < joints.size(); ++k) {
    const std::size_t j = joints[k];
    if (j > mount.joint) break;
    if (dynamics.slides(j)) {
      const Vec3& along = dynamics.axis(j);
      foot.jl.col(k) = along;
      foot.ql.col(k) = spin.cross(along);
      at_center += along * v[Tree::column(j)];
      continue;
    }
    const Vec3 &z = dynamics.axis(j), lever = foot.center - dynamics.origin(j);
    const double rate = v[Tree::column(j)];
    foot.jl.col(k) = z.cross(lever + arm);
    // first the parent's part; the part of the foot's own velocity follows when it is known
    foot.ql.col(k) = spin.cross(z.cross(lever)) - z.cross(at_center) + z.cross(spin).cross(arm) * -1.0;
    at_center += z.cross(lever) * rate;
    spin += z * rate;
  }
  foot.velocity = at_center + spin.cross(arm) - ground_velocity;
  foot.qb.template leftCols<3>().setZero();
  const double spin_arm = spin.dot(arm);
  for (int k = 0; k < 3; ++k) {  // (e x spin) x arm = spin (e.arm) - e (spin.arm)
    const auto e = rotation.col(k);
    foot.qb.col(3 + k) = e.cross(at_center) + spin * e.dot(arm) - e * spin_arm;
  }
  for (std::size_t k = 0; k < joints.size() && joints[k] <= mount.joint; ++k) {
    if (dynamics.slides(joints[k])) continue;  // what lies outwards keeps its direction
    const Vec3& z = dynamics.axis(joints[k]);
    foot.ql.col(k) += z.cross(at_center) + z.cross(spin).cross(arm);
  }
}

}  // namespace hexapod
