// Where a foot's sphere sits on the tree.
#pragma once

#include <cstddef>

#include <Eigen/Core>

namespace hexapod {

struct FootMount {
  std::size_t joint;       // 1 = the floating base
  Eigen::Vector3d offset;  // sphere centre in the joint's frame, m
  double radius;           // m
};

}  // namespace hexapod
