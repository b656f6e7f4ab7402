// The robot's bodies in plain numbers: a floating base and a tree of one-coordinate joints on it.
#pragma once

#include <cstddef>
#include <vector>

#include "laws/vectors.hpp"

namespace hexapod {

// Joints are counted as Pinocchio does: 0 the world, 1 the floating base, 2 ... the rest.
struct Tree {
  int nq = 0, nv = 0, joints = 0;  // `joints` counts all, the world too
  std::vector<std::size_t> parent;

  static std::size_t column(std::size_t joint) { return joint + 4; }  // of a joint >= 2 in v

  // joints between the base and `joint`, base side first
  std::vector<std::size_t> chain_to(std::size_t joint) const;
  // true if every joint belongs to a serial three-joint leg on the base (joints 2..4, 5..7, ...)
  bool has_three_joint_legs() const;
};

// A joint and the body that moves with it.
struct TreeBody {
  Vec6 motion = Vec6::Zero();           // unit twist of the joint: linear, angular; body axes
  Mat3 rotation = Mat3::Identity();     // of the joint's axes to its parent's, at q = 0
  Vec3 translation = Vec3::Zero();      // of its origin, parent's axes, m
  double mass = 0.0;                    // kg
  Vec3 lever = Vec3::Zero();            // centre of mass, m
  Mat3 inertia = Mat3::Zero();          // about the centre of mass, kg m^2

  bool revolute() const { return motion.head<3>().isZero(0.0); }
};

struct TreeModel {
  Tree tree;
  std::vector<TreeBody> bodies;  // of each joint; the world's is empty
  VectorXd armature;             // of each coordinate of v, kg m^2 or kg

  // `parent` of joints 1, 2, ...; every other argument has a row for each of them.
  // Throws std::invalid_argument: sizes differ, a parent comes after its child, or a joint other
  // than the base is neither revolute nor prismatic.
  TreeModel(const std::vector<std::size_t>& parent, std::vector<TreeBody> bodies,
            const VectorXd& armature);

  double total_mass() const;
};

}  // namespace hexapod
