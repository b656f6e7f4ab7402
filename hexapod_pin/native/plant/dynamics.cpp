#include "plant/dynamics.hpp"

#include <utility>

namespace hexapod {

Dynamics::Dynamics(TreeModel model, const Vec3& gravity, DynamicsPath path)
    : model_(std::make_shared<const TreeModel>(std::move(model))), gravity_(gravity),
      total_mass_(model_->total_mass()) {
  const Tree& shape = tree();
  mass_upper_.setZero(shape.nv, shape.nv);
  bias_.setZero(shape.nv);
  axis_.resize(shape.joints, Vec3::Zero());
  origin_.resize(shape.joints, Vec3::Zero());
  for (const TreeBody& body : model_->bodies) slides_.push_back(!body.revolute());
  if (path != DynamicsPath::pinocchio && FusedDynamics::fits(*model_))
    fused_.emplace(*model_, gravity, path == DynamicsPath::fused_baseline);
  else
    pinocchio_.emplace(*model_, gravity);
}

const char* Dynamics::path() const {
  if (!fused_) return "pinocchio";
  return fused_->avx2() ? "fused avx2" : "fused";
}

void Dynamics::compute(const VectorXd& q, const VectorXd& v) {
  if (fused_) {
    fused_->compute(q, v, mass_upper_, bias_, base_rotation_, axis_, origin_);
    center_of_mass_ = base_rotation_ * fused_->center_of_mass();
  } else {
    pinocchio_->compute(q, v, mass_upper_, bias_, base_rotation_, axis_, origin_);
    center_of_mass_ = pinocchio_->center_of_mass();
  }
}

Vec3 Dynamics::point(std::size_t joint, const Vec3& offset) const {
  if (!fused_) return pinocchio_->point(joint, offset);
  return origin_[joint] + base_rotation_ * (fused_->rotation(joint) * offset);
}

double Dynamics::repeat(const VectorXd& q, const VectorXd& v, long count) const {
  return PinocchioDynamics(*model_, gravity_).repeat(q, v, count);
}

}  // namespace hexapod
