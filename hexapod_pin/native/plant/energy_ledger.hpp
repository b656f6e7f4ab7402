// Works of servos, joints and contacts, and the impulses of the feet, accumulated over a run.
#pragma once

#include <vector>

#include "laws/vectors.hpp"

namespace hexapod {

struct EnergyLedger {
  double servo = 0.0;          // work of the servos, J
  double joint_damping = 0.0;  // loss in viscous joints, J
  double stops = 0.0;          // work put into the joint stops (stored or lost), J
  double normal = 0.0;         // work put into the contact normals (stored or lost), J
  double friction = 0.0;       // loss to friction, J
  double push = 0.0;           // work of the pushes, J
  std::vector<Vec3> impulse;  // per contact, since the last sample, N s, world axes

  explicit EnergyLedger(std::size_t contacts) : impulse(contacts, Vec3::Zero()) {}

  // Force f on a foot whose contact point moves at u, for a time dt.
  void add_contact(std::size_t contact, const Vec3& f, const Vec3& u,
                   const Vec3& normal_axis, double dt) {
    const double power = -normal_axis.dot(f) * normal_axis.dot(u);
    normal += dt * power;
    friction += dt * (-f.dot(u) - power);
    impulse[contact] += dt * f;
  }

  // As a row of numbers, for methods that integrate the works like any other quantity.
  static int size(std::size_t contacts) { return 6 + 3 * int(contacts); }

  template <class Row>
  void write(Row&& row) const {
    row[0] = servo, row[1] = joint_damping, row[2] = stops, row[3] = normal, row[4] = friction,
    row[5] = push;
    for (std::size_t i = 0; i < impulse.size(); ++i)
      for (int k = 0; k < 3; ++k) row[6 + 3 * i + k] = impulse[i][k];
  }

  template <class Row>
  void add_to(Row&& row) const {
    row[0] += servo, row[1] += joint_damping, row[2] += stops, row[3] += normal, row[4] += friction,
    row[5] += push;
    for (std::size_t i = 0; i < impulse.size(); ++i)
      for (int k = 0; k < 3; ++k) row[6 + 3 * i + k] += impulse[i][k];
  }

  template <class Row>
  void add(const Row& row) {
    servo += row[0], joint_damping += row[1], stops += row[2], normal += row[3], friction += row[4],
    push += row[5];
    for (std::size_t i = 0; i < impulse.size(); ++i)
      for (int k = 0; k < 3; ++k) impulse[i][k] += row[6 + 3 * i + k];
  }

  void clear() {
    servo = joint_damping = stops = normal = friction = push = 0.0;
    for (Vec3& i : impulse) i.setZero();
  }
};

}  // namespace hexapod
