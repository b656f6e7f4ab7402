// Coriolis, centrifugal and gravity forces from what CRBA (world convention) leaves behind: joint
// columns J, placements and composite inertias. The same numbers as Pinocchio's nonLinearEffects,
// which would walk the tree and take every sine a second time.
#pragma once

#include <vector>

#include <Eigen/Geometry>
#include <pinocchio/multibody.hpp>

namespace hexapod {

class Bias {
 public:
  explicit Bias(const pinocchio::Model& model) : bodies_(model.njoints), bias_(model.nv) {}

  // Needs CRBA in world convention at a configuration whose base is at the origin.
  void compute(const pinocchio::Model& model, const pinocchio::Data& data,
               const Eigen::VectorXd& v) {
    take_inertias(model, data);
    start_base(model, data, v);
    for (int j = 2; j < model.njoints; ++j) move(j, model, data, v);
    for (int j = model.njoints - 1; j > 1; --j) {
      Body& body = bodies_[j];
      load(body);
      const auto column = data.J.col(model.idx_vs[j]);
      bias_[model.idx_vs[j]] = column.head<3>().dot(body.force) + column.tail<3>().dot(body.moment);
      bodies_[model.parents[j]].force += body.force;
      bodies_[model.parents[j]].moment += body.moment;
    }
    load(bodies_[1]);
    const Eigen::Matrix3d& rotation = data.oMi[1].rotation();
    bias_.head<3>().noalias() = rotation.transpose() * bodies_[1].force;
    bias_.segment<3>(3).noalias() = rotation.transpose() * bodies_[1].moment;
  }

  const Eigen::VectorXd& value() const { return bias_; }
  void swap(Eigen::VectorXd& other) { bias_.swap(other); }

 private:
  using Vec3 = Eigen::Vector3d;

  struct Body {  // everything at the world's origin, world axes
    double mass;
    Vec3 first;               // m c
    Eigen::Matrix3d second;   // about the origin
    Vec3 v, w, a, alpha;      // velocity and bias acceleration, linear and angular
    Vec3 force, moment;       // of the body and, later, its subtree
  };

  // A body's own inertia is its composite's less those of its children.
  void take_inertias(const pinocchio::Model& model, const pinocchio::Data& data) {
    for (int j = 1; j < model.njoints; ++j) {
      Body& body = bodies_[j];
      const auto& y = data.oYcrb[j];
      const Vec3& c = y.lever();
      body.mass = y.mass();
      body.first = y.mass() * c;
      body.second = y.inertia().matrix();
      body.second.noalias() -= body.first * c.transpose();
      body.second.diagonal().array() += body.first.dot(c);
    }
    for (int j = 2; j < model.njoints; ++j) {  // parents come first: children are still whole
      Body& parent = bodies_[model.parents[j]];
      parent.mass -= bodies_[j].mass;
      parent.first -= bodies_[j].first;
      parent.second -= bodies_[j].second;
    }
  }

  void start_base(const pinocchio::Model& model, const pinocchio::Data& data,
                  const Eigen::VectorXd& v) {
    Body& base = bodies_[1];
    base.v.noalias() = data.oMi[1].rotation() * v.head<3>();
    base.w.noalias() = data.oMi[1].rotation() * v.segment<3>(3);
    base.a = -model.gravity.linear();
    base.alpha.setZero();
    base.force.setZero();
    base.moment.setZero();
  }

  // v_j = v_p + S q', a_j = a_p + v_p x S q' (spatial)
  void move(int j, const pinocchio::Model& model, const pinocchio::Data& data,
            const Eigen::VectorXd& v) {
    const Body& parent = bodies_[model.parents[j]];
    Body& body = bodies_[j];
    const double rate = v[model.idx_vs[j]];
    const Vec3 sv = data.J.col(model.idx_vs[j]).head<3>() * rate;
    const Vec3 sw = data.J.col(model.idx_vs[j]).tail<3>() * rate;
    body.v = parent.v + sv;
    body.w = parent.w + sw;
    body.a = parent.a + parent.w.cross(sv) + parent.v.cross(sw);
    body.alpha = parent.alpha + parent.w.cross(sw);
    body.force.setZero();
    body.moment.setZero();
  }

  static void load(Body& b) {  // f = Y a + v x* Y v
    const Vec3 p = b.mass * b.v + b.w.cross(b.first);
    const Vec3 l = b.second * b.w + b.first.cross(b.v);
    b.force += b.mass * b.a + b.alpha.cross(b.first) + b.w.cross(p);
    b.moment += b.second * b.alpha + b.first.cross(b.a) + b.w.cross(l) + b.v.cross(p);
  }

  std::vector<Body> bodies_;
  Eigen::VectorXd bias_;
};

}  // namespace hexapod
