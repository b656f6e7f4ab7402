// Where a foot's sphere sits on the tree.
#pragma once

#include <cstddef>

#include "laws/vectors.hpp"

namespace hexapod {

struct FootMount {
  std::size_t joint;       // 1 = the floating base
  Vec3 offset;  // sphere centre in the joint's frame, m
  double radius;           // m
};

}  // namespace hexapod
