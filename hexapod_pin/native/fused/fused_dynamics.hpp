// The fused pass for a Pinocchio model: takes the numbers out of the model once, then does without.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <pinocchio/multibody/data.hpp>
#include <pinocchio/multibody/model.hpp>

#include "fused/fused_legs.hpp"
#include "plant/dynamics.hpp"

namespace hexapod {

namespace fused {

// nullptr: nothing but the baseline
inline Pass build_for_this_processor() {
#if defined(__x86_64__) || defined(__i386__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return kAvx2Build;
#endif
  return nullptr;
}

// A rotation to axes of which z is the given one; exact for x, y and z.
inline Mat3 to_axes_along(const Vec3& axis) {
  int least = 1;
  for (int i : {0, 2})
    if (std::abs(axis[i]) < std::abs(axis[least])) least = i;
  Mat3 rows;
  rows.row(0) = (Vec3::Unit(least) - axis * axis[least]).normalized().transpose();
  rows.row(1) = axis.cross(rows.row(0).transpose()).transpose();
  rows.row(2) = axis.transpose();
  return rows;
}

}  // namespace fused

class FusedDynamics {
 public:
  // One to eight legs of three revolute joints. Prismatic, helical, composite ones: Pinocchio's.
  static bool fits(const pinocchio::Model& model, const Tree& tree) {
    if (!tree.has_three_joint_legs() || tree.joints > 2 + 3 * fused::kMostLegs) return false;
    for (int j = 2; j < tree.joints; ++j) {
      const std::string kind = model.joints[j].shortname();
      if (kind != "JointModelRX" && kind != "JointModelRY" && kind != "JointModelRZ" &&
          kind != "JointModelRevoluteUnaligned")
        return false;
    }
    return true;
  }

  FusedDynamics(const pinocchio::Model& model, pinocchio::Data& data, bool baseline)
      : pass_(baseline ? nullptr : fused::build_for_this_processor()), align_(model.njoints) {
    if (pass_ == nullptr) pass_ = fused::kBaselineBuild;
    Eigen::Map<Vec3>(robot_.gravity) = model.gravity.linear();
    robot_.legs = (model.njoints - 2) / 3;
    take_base(model);
    align_[0] = align_[1] = Mat3::Identity();
    for (int j = 2; j < model.njoints; ++j) take_joint(j, model, data);
  }

  bool avx2() const { return pass_ == fused::kAvx2Build; }

  void compute(const VectorXd& q, const VectorXd& v, Eigen::MatrixXd& mass_upper, VectorXd& bias,
               Mat3& base_rotation, std::vector<Vec3>& axis, std::vector<Vec3>& origin) {
    pass_(robot_, q.data() + 3, v.data(),
          {mass_upper.data(), bias.data(), base_rotation.data(), axis[2].data(), origin[2].data(),
           first_moment_.data(), rotation_.data()});
  }

  // rotation of a joint's body to base axes
  Mat3 rotation(std::size_t joint) const {
    if (joint < 2) return Mat3::Identity();
    const auto& lanes = rotation_[(joint - 2) % 3];
    Mat3 r;
    for (int i = 0; i < 9; ++i) r.data()[i] = lanes[i][(joint - 2) / 3];
    return r * align_[joint];
  }

  Vec3 center_of_mass() const { return first_moment_ / robot_.total_mass; }  // base axes

 private:
  void take_base(const pinocchio::Model& model) {
    const auto& base = model.inertias[1];
    const Vec3 first = base.mass() * base.lever();
    const Mat3 second = base.inertia().matrix() - first * base.lever().transpose() +
                        first.dot(base.lever()) * Mat3::Identity();
    robot_.mass = base.mass();
    Eigen::Map<Vec3>(robot_.first) = first;
    put_symmetric(second, robot_.second, 1);
    Eigen::Map<Eigen::Matrix<double, 6, 1>>(robot_.armature) = model.armature.head<6>();
    for (int j = 1; j < model.njoints; ++j) robot_.total_mass += model.inertias[j].mass();
  }

  void take_joint(int j, const pinocchio::Model& model, pinocchio::Data& data) {
    const int leg = (j - 2) / 3;
    fused::Joint& to = robot_.joint[(j - 2) % 3];
    model.joints[j].calc(data.joints[j], VectorXd::Zero(model.nq));
    const Vec3 axis = data.joints[j].S().matrix().col(0).tail<3>();
    align_[j] = fused::to_axes_along(axis);
    const Mat3& parent = align_[model.parents[j]];
    const Mat3 placement = parent * model.jointPlacements[j].rotation() * align_[j].transpose();
    const Vec3 offset = parent * model.jointPlacements[j].translation();
    const Vec3 com = align_[j] * model.inertias[j].lever();
    for (int i = 0; i < 9; ++i) to.placement[i][leg] = placement.data()[i];
    for (int i = 0; i < 3; ++i) to.offset[i][leg] = offset[i];
    for (int i = 0; i < 3; ++i) to.com[i][leg] = com[i];
    to.mass[leg] = model.inertias[j].mass();
    const Mat3 inertia = model.inertias[j].inertia().matrix();
    put_symmetric(align_[j] * inertia * align_[j].transpose(), to.inertia[0] + leg,
                  fused::kMostLegs);
    to.armature[leg] = model.armature[model.idx_vs[j]];
  }

  static void put_symmetric(const Mat3& s, double* to, int stride) {
    const double upper[6] = {s(0, 0), s(0, 1), s(1, 1), s(0, 2), s(1, 2), s(2, 2)};
    for (int i = 0; i < 6; ++i) to[i * stride] = upper[i];
  }

  fused::Robot robot_;
  fused::Pass pass_;
  std::array<fused::PerLeg[9], 3> rotation_ = {};
  Vec3 first_moment_ = Vec3::Zero();
  std::vector<Mat3> align_;  // to the axes of the pass, of each joint's body
};

}  // namespace hexapod
