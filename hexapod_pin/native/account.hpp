// What the integrators keep book of during a run: works, and the impulses of the feet.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace hexapod {

struct Account {
  double servo = 0.0;          // work of the servos, J
  double joint_damping = 0.0;  // loss in viscous joints, J
  double normal = 0.0;         // work put into the contact normals (stored or lost), J
  double friction = 0.0;       // loss to friction, J
  std::vector<Eigen::Vector3d> impulse;  // per foot, since the last sample, N s, world axes

  explicit Account(std::size_t feet) : impulse(feet, Eigen::Vector3d::Zero()) {}

  // Force f on a foot whose contact point moves at u, for a time dt.
  void add_contact(std::size_t foot, const Eigen::Vector3d& f, const Eigen::Vector3d& u,
                   const Eigen::Vector3d& normal_axis, double dt) {
    const double power = -normal_axis.dot(f) * normal_axis.dot(u);
    normal += dt * power;
    friction += dt * (-f.dot(u) - power);
    impulse[foot] += dt * f;
  }
};

}  // namespace hexapod
