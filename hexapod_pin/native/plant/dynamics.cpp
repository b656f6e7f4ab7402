#include "plant/dynamics.hpp"

#include <optional>
#include <stdexcept>

#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody/data.hpp>
#include <pinocchio/multibody/model.hpp>
#include <pinocchio/serialization/model.hpp>

#include "fused/fused_dynamics.hpp"
#include "plant/bias.hpp"

namespace hexapod {

std::vector<std::size_t> Tree::chain_to(std::size_t joint) const {
  std::vector<std::size_t> chain;
  for (std::size_t j = joint; j > 1; j = parent[j]) chain.insert(chain.begin(), j);
  return chain;
}

bool Tree::has_three_joint_legs() const {
  if (joints == 2 || (joints - 2) % 3 != 0) return false;
  for (std::size_t j = 2; j < std::size_t(joints); j += 3)
    if (parent[j] != 1 || parent[j + 1] != j || parent[j + 2] != j + 1) return false;
  return true;
}

namespace {

pinocchio::Model read_model(const std::string& text, const Vec3& gravity) {
  pinocchio::Model model;
  model.loadFromString(text);
  model.gravity.linear() = gravity;
  if (model.njoints < 2 || model.nvs[1] != 6)
    throw std::invalid_argument("the model's first joint must be a free-flyer");
  for (int j = 2; j < model.njoints; ++j)
    if (model.nqs[j] != 1 || model.nvs[j] != 1 || model.idx_vs[j] != int(Tree::column(j)) ||
        model.idx_qs[j] != model.idx_vs[j] + 1)
      throw std::invalid_argument("joint " + model.names[j] + " must have one coordinate");
  return model;
}

}  // namespace

struct Dynamics::Impl {
  explicit Impl(pinocchio::Model m) : model(std::move(m)), data(model), bias(model) {
    data.M.setZero();
  }
  pinocchio::Model model;
  pinocchio::Data data;
  Bias bias;
  std::optional<FusedDynamics> fused;
};

Dynamics::Dynamics(const std::string& model, const Vec3& gravity, DynamicsPath path)
    : impl_(std::make_unique<Impl>(read_model(model, gravity))), gravity_(gravity) {
  const pinocchio::Model& m = impl_->model;
  tree_ = {m.nq, m.nv, m.njoints, {m.parents.begin(), m.parents.end()}};
  for (const auto& inertia : m.inertias) total_mass_ += inertia.mass();
  mass_upper_.setZero(m.nv, m.nv);
  bias_.setZero(m.nv);
  axis_.resize(m.njoints, Vec3::Zero());
  origin_.resize(m.njoints, Vec3::Zero());
  if (path != DynamicsPath::pinocchio && FusedDynamics::fits(m, tree_))
    impl_->fused.emplace(m, impl_->data, path == DynamicsPath::fused_baseline);
}

Dynamics::Dynamics(const Dynamics& other)
    : impl_(std::make_unique<Impl>(*other.impl_)), tree_(other.tree_), gravity_(other.gravity_),
      total_mass_(other.total_mass_), mass_upper_(other.mass_upper_), bias_(other.bias_),
      base_rotation_(other.base_rotation_), axis_(other.axis_), origin_(other.origin_) {}

Dynamics::Dynamics(Dynamics&& other) noexcept = default;
Dynamics::~Dynamics() = default;

const char* Dynamics::path() const {
  if (!impl_->fused) return "pinocchio";
  return impl_->fused->avx2() ? "fused avx2" : "fused";
}

void Dynamics::compute(const VectorXd& q, const VectorXd& v) {
  if (impl_->fused) {
    impl_->fused->compute(q, v, mass_upper_, bias_, base_rotation_, axis_, origin_);
    return;
  }
  auto& [model, data, bias, fused] = *impl_;
  pinocchio::crba(model, data, q, pinocchio::Convention::WORLD);
  bias.compute(model, data, v);
  base_rotation_ = data.oMi[1].rotation();
  for (std::size_t j = 2; j < std::size_t(model.njoints); ++j) {
    axis_[j] = data.J.block<3, 1>(3, Tree::column(j));
    origin_[j] = data.oMi[j].translation();
  }
  mass_upper_.swap(data.M);
  bias.swap(bias_);
}

Vec3 Dynamics::point(std::size_t joint, const Vec3& offset) const {
  if (!impl_->fused) return impl_->data.oMi[joint].act(offset);
  return origin_[joint] + base_rotation_ * (impl_->fused->rotation(joint) * offset);
}

Vec3 Dynamics::center_of_mass() const {
  if (!impl_->fused) return impl_->data.oYcrb[0].lever();
  return base_rotation_ * impl_->fused->center_of_mass();
}

double Dynamics::repeat(const VectorXd& q, const VectorXd& v, long count) const {
  const pinocchio::Model& model = impl_->model;
  pinocchio::Data data(model);
  double sum = 0.0;
  for (long k = 0; k < count; ++k) {
    pinocchio::crba(model, data, q, pinocchio::Convention::WORLD);
    pinocchio::nonLinearEffects(model, data, q, v);
    sum += data.nle[0];
  }
  return sum;
}

}  // namespace hexapod
