// Mass matrix, bias and kinematics of a floating-base tree of one-coordinate joints: by the fused pass
// where the robot suits it, else by Pinocchio.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "fused/fused_dynamics.hpp"
#include "plant/pinocchio_dynamics.hpp"
#include "plant/tree.hpp"

namespace hexapod {

// Who computes. The fused pass wants one to eight legs of three revolute joints; Pinocchio does the
// rest. `fused` takes AVX2 and FMA where the processor has them, and so differs by round-off from
// processors without; `fused_baseline` is the same code on all of them.
enum class DynamicsPath { fused, fused_baseline, pinocchio };

class Dynamics {
 public:
  // gravity in world axes, m/s^2
  Dynamics(TreeModel model, const Vec3& gravity, DynamicsPath path = DynamicsPath::fused);

  // q with the base at the origin. Everything below refers to the last call, world axes, relative to
  // the base's origin.
  void compute(const VectorXd& q, const VectorXd& v);

  const char* path() const;  // "fused avx2", "fused" or "pinocchio"
  const Tree& tree() const { return model_->tree; }
  const Vec3& gravity() const { return gravity_; }
  double total_mass() const { return total_mass_; }
  const Eigen::MatrixXd& mass_upper() const { return mass_upper_; }  // only that triangle is filled
  const VectorXd& bias() const { return bias_; }  // C v + g, as Pinocchio's nonLinearEffects
  void subtract_from_bias(const VectorXd& force) { bias_ -= force; }
  // Those of another call, which `compute` has left here before: the mass matrix, the bias, the base's
  // rotation and the centre of mass. Kinematics stay those of the last call.
  struct Results {
    Eigen::MatrixXd mass_upper;  // of the same size, with the same zeros
    VectorXd bias;
    Mat3 base_rotation = Mat3::Identity();
    Vec3 center_of_mass = Vec3::Zero();
  };
  void swap_results(Results& other) {
    mass_upper_.swap(other.mass_upper);
    bias_.swap(other.bias);
    base_rotation_.swap(other.base_rotation);
    center_of_mass_.swap(other.center_of_mass);
  }
  const Mat3& base_rotation() const { return base_rotation_; }
  const Vec3& axis(std::size_t joint) const { return axis_[joint]; }
  bool slides(std::size_t joint) const { return slides_[joint]; }  // along its axis, else turns about it
  const Vec3& origin(std::size_t joint) const { return origin_[joint]; }
  Vec3 point(std::size_t joint, const Vec3& offset) const;  // a point fixed to the joint's body
  const Vec3& center_of_mass() const { return center_of_mass_; }

  // Pinocchio's crba and nonLinearEffects and nothing else, `count` times, for benchmarks
  double repeat(const VectorXd& q, const VectorXd& v, long count) const;

 private:
  std::shared_ptr<const TreeModel> model_;
  std::optional<FusedDynamics> fused_;
  std::optional<PinocchioDynamics> pinocchio_;  // where there is no fused pass
  Vec3 gravity_;
  double total_mass_ = 0.0;
  Eigen::MatrixXd mass_upper_;
  VectorXd bias_;
  Mat3 base_rotation_ = Mat3::Identity();
  Vec3 center_of_mass_ = Vec3::Zero();
  std::vector<Vec3> axis_, origin_;
  std::vector<char> slides_;
};

}  // namespace hexapod
