// Which joints carry which foot, and whether the tree is a base with three-joint legs.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include <pinocchio/multibody/model.hpp>

namespace hexapod {

struct FootMount {
  std::size_t joint;       // Pinocchio joint index; 1 = the floating base
  Eigen::Vector3d offset;  // sphere centre in the joint's frame, m
  double radius;           // m
};

// joints between the base and `joint`, base side first, as Pinocchio joint indices
inline std::vector<std::size_t> chain_to(const pinocchio::Model& model, std::size_t joint) {
  std::vector<std::size_t> chain;
  for (std::size_t j = joint; j > 1; j = model.parents[j]) chain.insert(chain.begin(), j);
  return chain;
}

inline void require_supported(const pinocchio::Model& model) {
  if (model.njoints < 2 || model.nvs[1] != 6)
    throw std::invalid_argument("the model's first joint must be a free-flyer");
  for (int j = 2; j < model.njoints; ++j)
    if (model.nqs[j] != 1 || model.nvs[j] != 1 || model.idx_qs[j] != model.idx_vs[j] + 1)
      throw std::invalid_argument("joint " + model.names[j] + " must have one coordinate");
}

// true if every joint belongs to a serial three-joint leg on the base (joints 2..4, 5..7, ...)
inline bool has_three_joint_legs(const pinocchio::Model& model) {
  if ((model.njoints - 2) % 3 != 0 || model.njoints == 2) return false;
  for (int j = 2; j < model.njoints; j += 3)
    if (model.parents[j] != 1 || model.parents[j + 1] != std::size_t(j) ||
        model.parents[j + 2] != std::size_t(j + 1))
      return false;
  return true;
}

}  // namespace hexapod
