// Works of servos, joints and contacts, and the impulses of the feet, accumulated over a run.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace hexapod {

struct EnergyLedger {
  double servo = 0.0;          // work of the servos, J
  double joint_damping = 0.0;  // loss in viscous joints, J
  double stops = 0.0;          // work put into the joint stops (stored or lost), J
  double normal = 0.0;         // work put into the contact normals (stored or lost), J
  double friction = 0.0;       // loss to friction, J
  std::vector<Eigen::Vector3d> impulse;  // per contact, since the last sample, N s, world axes

  explicit EnergyLedger(std::size_t contacts) : impulse(contacts, Eigen::Vector3d::Zero()) {}

  // Force f on a foot whose contact point moves at u, for a time dt.
  void add_contact(std::size_t contact, const Eigen::Vector3d& f, const Eigen::Vector3d& u,
                   const Eigen::Vector3d& normal_axis, double dt) {
    const double power = -normal_axis.dot(f) * normal_axis.dot(u);
    normal += dt * power;
    friction += dt * (-f.dot(u) - power);
    impulse[contact] += dt * f;
  }

  // As a row of numbers, for methods that integrate the works like any other quantity.
  static int size(std::size_t contacts) { return 5 + 3 * int(contacts); }

  template <class Row>
  void write(Row&& row) const {
    row[0] = servo, row[1] = joint_damping, row[2] = stops, row[3] = normal, row[4] = friction;
    for (std::size_t i = 0; i < impulse.size(); ++i)
      for (int k = 0; k < 3; ++k) row[5 + 3 * i + k] = impulse[i][k];
  }

  template <class Row>
  void add_to(Row&& row) const {
    row[0] += servo, row[1] += joint_damping, row[2] += stops, row[3] += normal, row[4] += friction;
    for (std::size_t i = 0; i < impulse.size(); ++i)
      for (int k = 0; k < 3; ++k) row[5 + 3 * i + k] += impulse[i][k];
  }

  template <class Row>
  void add(const Row& row) {
    servo += row[0], joint_damping += row[1], stops += row[2], normal += row[3], friction += row[4];
    for (std::size_t i = 0; i < impulse.size(); ++i)
      for (int k = 0; k < 3; ++k) impulse[i][k] += row[5 + 3 * i + k];
  }

  void clear() {
    servo = joint_damping = stops = normal = friction = 0.0;
    for (Eigen::Vector3d& i : impulse) i.setZero();
  }
};

}  // namespace hexapod
