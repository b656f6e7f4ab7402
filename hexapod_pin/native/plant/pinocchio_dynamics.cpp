#include "plant/pinocchio_dynamics.hpp"

#include <string>

#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include "plant/bias.hpp"

namespace hexapod {

namespace {

using ConstVector = Eigen::Ref<const VectorXd>;  // what the library's instantiations take

pinocchio::JointModel joint_model(const TreeBody& body) {
  const bool turns = body.revolute();
  const Vec3 axis = turns ? body.motion.tail<3>() : body.motion.head<3>();
  if (axis == Vec3::UnitX())
    return turns ? pinocchio::JointModel(pinocchio::JointModelRX()) : pinocchio::JointModelPX();
  if (axis == Vec3::UnitY())
    return turns ? pinocchio::JointModel(pinocchio::JointModelRY()) : pinocchio::JointModelPY();
  if (axis == Vec3::UnitZ())
    return turns ? pinocchio::JointModel(pinocchio::JointModelRZ()) : pinocchio::JointModelPZ();
  if (turns) return pinocchio::JointModelRevoluteUnaligned(axis);
  return pinocchio::JointModelPrismaticUnaligned(axis);
}

std::shared_ptr<const pinocchio::Model> build(const TreeModel& from, const Vec3& gravity) {
  auto model = std::make_shared<pinocchio::Model>();
  for (std::size_t j = 1; j < from.bodies.size(); ++j) {
    const TreeBody& body = from.bodies[j];
    const pinocchio::SE3 placement(body.rotation, body.translation);
    model->addJoint(from.tree.parent[j],
                    j == 1 ? pinocchio::JointModel(pinocchio::JointModelFreeFlyer())
                           : joint_model(body),
                    placement, std::to_string(j));
    model->inertias[j] =
        pinocchio::Inertia(body.mass, body.lever, pinocchio::Symmetric3(body.inertia));
  }
  model->armature = from.armature;
  model->gravity.linear() = gravity;
  return model;
}

}  // namespace

struct PinocchioDynamics::Impl {
  explicit Impl(std::shared_ptr<const pinocchio::Model> m)
      : model(std::move(m)), data(*model), bias(*model) {
    data.M.setZero();
  }
  std::shared_ptr<const pinocchio::Model> model;
  pinocchio::Data data;
  Bias bias;
};

PinocchioDynamics::PinocchioDynamics(const TreeModel& model, const Vec3& gravity)
    : impl_(std::make_unique<Impl>(build(model, gravity))) {
  for (const TreeBody& body : model.bodies) turns_.push_back(body.revolute());
}

PinocchioDynamics::PinocchioDynamics(const PinocchioDynamics& other)
    : impl_(std::make_unique<Impl>(other.impl_->model)), turns_(other.turns_) {
  impl_->data.oMi = other.impl_->data.oMi;
  impl_->data.oYcrb = other.impl_->data.oYcrb;
}

PinocchioDynamics::~PinocchioDynamics() = default;

void PinocchioDynamics::compute(const VectorXd& q, const VectorXd& v, Eigen::MatrixXd& mass_upper,
                                VectorXd& bias, Mat3& base_rotation, std::vector<Vec3>& axis,
                                std::vector<Vec3>& origin) {
  const pinocchio::Model& model = *impl_->model;
  pinocchio::Data& data = impl_->data;
  pinocchio::crba(model, data, ConstVector(q), pinocchio::Convention::WORLD);
  impl_->bias.compute(model, data, v);
  base_rotation = data.oMi[1].rotation();
  for (std::size_t j = 2; j < std::size_t(model.njoints); ++j) {
    const int part = turns_[j] ? 3 : 0;  // of a column: angular, or linear
    axis[j] = data.J.block<3, 1>(part, Tree::column(j));
    origin[j] = data.oMi[j].translation();
  }
  mass_upper.swap(data.M);
  impl_->bias.swap(bias);
}

Vec3 PinocchioDynamics::point(std::size_t joint, const Vec3& offset) const {
  return impl_->data.oMi[joint].act(offset);
}

Vec3 PinocchioDynamics::center_of_mass() const { return impl_->data.oYcrb[0].lever(); }

double PinocchioDynamics::repeat(const VectorXd& q, const VectorXd& v, long count) const {
  const pinocchio::Model& model = *impl_->model;
  pinocchio::Data data(model);
  double sum = 0.0;
  for (long k = 0; k < count; ++k) {
    pinocchio::crba(model, data, ConstVector(q), pinocchio::Convention::WORLD);
    pinocchio::nonLinearEffects(model, data, ConstVector(q), ConstVector(v));
    sum += data.nle[0];
  }
  return sum;
}

}  // namespace hexapod
