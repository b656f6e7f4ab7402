#include "fused/fused_dynamics.hpp"

#include <cmath>

#include <Eigen/Geometry>

namespace hexapod {

namespace {

// nullptr: nothing but the baseline
fused::Pass build_for_this_processor() {
#if defined(__x86_64__) || defined(__i386__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return fused::kAvx2Build;
#endif
  return nullptr;
}

// A rotation to axes of which z is the given one; exact for x, y and z.
Mat3 to_axes_along(const Vec3& axis) {
  int least = 1;
  for (int i : {0, 2})
    if (std::abs(axis[i]) < std::abs(axis[least])) least = i;
  Mat3 rows;
  rows.row(0) = (Vec3::Unit(least) - axis * axis[least]).normalized().transpose();
  rows.row(1) = axis.cross(rows.row(0).transpose()).transpose();
  rows.row(2) = axis.transpose();
  return rows;
}

void put_symmetric(const Mat3& s, double* to, int stride) {
  const double upper[6] = {s(0, 0), s(0, 1), s(1, 1), s(0, 2), s(1, 2), s(2, 2)};
  for (int i = 0; i < 6; ++i) to[i * stride] = upper[i];
}

}  // namespace

bool FusedDynamics::fits(const TreeModel& model) {
  const Tree& tree = model.tree;
  if (!tree.has_three_joint_legs() || tree.joints > 2 + 3 * fused::kMostLegs) return false;
  for (int j = 2; j < tree.joints; ++j)
    if (!model.bodies[j].revolute()) return false;
  return true;
}

FusedDynamics::FusedDynamics(const TreeModel& model, const Vec3& gravity, bool baseline)
    : pass_(baseline ? nullptr : build_for_this_processor()), align_(model.tree.joints) {
  if (pass_ == nullptr) pass_ = fused::kBaselineBuild;
  Eigen::Map<Vec3>(robot_.gravity) = gravity;
  robot_.legs = (model.tree.joints - 2) / 3;
  take_base(model);
  align_[0] = align_[1] = Mat3::Identity();
  for (std::size_t j = 2; j < align_.size(); ++j) take_joint(j, model);
}

void FusedDynamics::take_base(const TreeModel& model) {
  const TreeBody& base = model.bodies[1];
  const Vec3 first = base.mass * base.lever;
  const Mat3 second =
      base.inertia - first * base.lever.transpose() + first.dot(base.lever) * Mat3::Identity();
  robot_.mass = base.mass;
  Eigen::Map<Vec3>(robot_.first) = first;
  put_symmetric(second, robot_.second, 1);
  Eigen::Map<Vec6>(robot_.armature) = model.armature.head<6>();
  robot_.total_mass = model.total_mass();
}

void FusedDynamics::take_joint(std::size_t joint, const TreeModel& model) {
  const std::size_t leg = (joint - 2) / 3;
  fused::Joint& to = robot_.joint[(joint - 2) % 3];
  const TreeBody& body = model.bodies[joint];
  align_[joint] = to_axes_along(body.motion.tail<3>());
  const Mat3 &align = align_[joint], &parent = align_[model.tree.parent[joint]];
  const Mat3 placement = parent * body.rotation * align.transpose();
  const Vec3 offset = parent * body.translation, com = align * body.lever;
  for (int i = 0; i < 9; ++i) to.placement[i][leg] = placement.data()[i];
  for (int i = 0; i < 3; ++i) to.offset[i][leg] = offset[i];
  for (int i = 0; i < 3; ++i) to.com[i][leg] = com[i];
  to.mass[leg] = body.mass;
  put_symmetric(align * body.inertia * align.transpose(), to.inertia[0] + leg, fused::kMostLegs);
  to.armature[leg] = model.armature[Eigen::Index(Tree::column(joint))];
}

Mat3 FusedDynamics::rotation(std::size_t joint) const {
  if (joint < 2) return Mat3::Identity();
  const auto& lanes = rotation_[(joint - 2) % 3];
  Mat3 r;
  for (int i = 0; i < 9; ++i) r.data()[i] = lanes[i][(joint - 2) / 3];
  return r * align_[joint];
}

}  // namespace hexapod
