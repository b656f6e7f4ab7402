// The robot on its ground: mass matrix, bias, feet with Jacobians, servos, at one state (q, v).
#pragma once

#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

#include "laws/feet.hpp"
#include "laws/servo.hpp"
#include "laws/stops.hpp"
#include "laws/terrain.hpp"
#include "plant/chart.hpp"
#include "plant/dynamics.hpp"
#include "plant/energy_ledger.hpp"
#include "plant/mount.hpp"

namespace hexapod {

constexpr double kTouchDepth = 2e-7;  // located touch-downs are less deep, m

template <class SystemT>
class Plant {
 public:
  using System = SystemT;
  using Foot = FootState<typename System::LegJacobian>;

  Plant(const Dynamics& body, std::vector<FootMount> mounts, ContactLaw law, Terrain terrain,
        Servo servo, JointStops stops)
      : dynamics(body), tree(body.tree()), mounts(std::move(mounts)), law(law),
        terrain(std::move(terrain)), servo(std::move(servo)), stops(std::move(stops)), system(tree, this->mounts),
        per_foot(this->terrain.most()), feet(this->mounts.size() * per_foot),
        stop(tree.nv - 6), q_local_(VectorXd::Zero(tree.nq)) {
    for (const FootMount& mount : this->mounts) columns_.push_back(system.columns(tree, mount));
    for (std::size_t i = 0; i < feet.size(); ++i) {
      feet[i].jl.setZero(3, System::kLegColumns == Eigen::Dynamic ? columns(i).size() : 3);
      feet[i].ql = feet[i].jl;
    }
    v_.setZero(tree.nv);
    kept_ = {Eigen::MatrixXd::Zero(tree.nv, tree.nv), VectorXd::Zero(tree.nv), v_, feet, stop};
  }

  // Everything below refers to the state of the last call. Dynamics do not depend on the base
  // position, so they are evaluated with the base at the origin: no digits are lost far away.
  // `lead` is the step of a method that takes contact forces at its end, else 0.
  void evaluate(double t, const VectorXd& q, const VectorXd& v, double lead) {
    q_local_.tail(tree.nq - 3) = q.tail(tree.nq - 3);
    v_ = v;
    dynamics.compute(q_local_, v);
    ground_velocity = Vec3(0.0, 0.0, terrain.lift_rate(t));
    for (std::size_t f = 0; f < mounts.size(); ++f) place_foot(f, t, q, v, lead);
    for (int j = 0; j < joints(); ++j) stop[j] = stops(j, q[7 + j], v[6 + j]);
    ++evaluations;
  }

  // Keeps what solving needs of the evaluated state while others are evaluated; recall brings it back.
  void keep() {
    swap_kept();
    for (std::size_t i = 0; i < feet.size(); ++i) {
      feet[i].memory = kept_.feet[i].memory;
      feet[i].ground = kept_.feet[i].ground;
    }
  }
  void recall() { swap_kept(); }

  // The contact forces again, for another lead; q as in the last call.
  void change_lead(const VectorXd& q, double lead) {
    if (law.friction.kind != FrictionKind::bristle) return;
    for (Foot& foot : feet)
      if (foot.active) load_foot(foot, q.head<3>() + foot.center, lead);
  }

  // At an accepted state: contacts that have begun or ended change their memory. The touch speed is
  // that of the last state out of the ground, or of the first in it where that is a located touch-down.
  void settle_memory() {
    for (Foot& foot : feet) {
      const bool located = foot.active && !foot.memory.touching && foot.ground.gap > -kTouchDepth;
      if (foot.active) foot.memory.touching = true;
      else if (foot.memory.touching) foot.memory.let_go();
      if ((!foot.active || located) && law.normal.needs_touch_speed() && foot.ground.gap < kFarAway)
        foot.memory.touch_speed = std::max(0.0, -foot.ground.normal.dot(foot.velocity));
    }
  }

  const Eigen::MatrixXd& mass_upper() const { return dynamics.mass_upper(); }
  const VectorXd& bias() const { return dynamics.bias(); }
  int joints() const { return tree.nv - 6; }
  double rate(int joint) const { return v_[6 + joint]; }
  Vec3 center_of_mass() const { return dynamics.center_of_mass(); }  // relative to the base origin

  double kinetic_energy(const VectorXd& v) const {  // the upper triangle holds all of M
    double twice = 0.0;
    for (int c = 0; c < tree.nv; ++c)
      twice += v[c] * (2.0 * mass_upper().col(c).head(c).dot(v.head(c)) + mass_upper()(c, c) * v[c]);
    return 0.5 * twice;
  }

  std::size_t foot_of(std::size_t contact) const { return contact / per_foot; }

  template <class Force>
  void add_transposed(std::size_t i, const Force& f, VectorXd& out) const {
    const Foot& foot = feet[i];
    out.head<6>().noalias() += foot.jb.transpose() * f;
    for (std::size_t k = 0; k < columns(i).size(); ++k)
      out[Tree::column(columns(i)[k])] += foot.jl.col(k).dot(f);
  }

  // [xb xl] v for a contact's 3 x (6 + leg) matrix, e.g. (jb, jl) or (qb, ql)
  Vec3 along(std::size_t i, const Eigen::Matrix<double, 3, 6>& xb,
             const typename System::LegJacobian& xl, const VectorXd& v) const {
    Vec3 sum = xb * v.head<6>();
    for (std::size_t k = 0; k < columns(i).size(); ++k)
      sum += xl.col(k) * v[Tree::column(columns(i)[k])];
    return sum;
  }

  // energy stored in a contact's normal spring and in its bristle, J
  double stored_normal(const Foot& foot) const {
    return foot.k_scale * law.normal.energy(-foot.ground.gap);
  }
  double stored_bristle(const Foot& foot) const {
    return 0.5 * law.friction.bristle_stiffness * foot.memory.stretch.squaredNorm();
  }

  // Servo torques at the evaluated state for set-points (q_ref, v_ref).
  void servo_torque(const VectorXd& q, const VectorXd& v, const VectorXd& q_ref,
                    const VectorXd& v_ref, VectorXd& torque) const {
    for (int j = 0; j < joints(); ++j)
      torque[j] = servo.torque(j, q_ref[j] - q[7 + j], v_ref[j] - v[6 + j]);
  }

  double stored_in_stops(const VectorXd& q) const {
    double sum = 0.0;
    for (int j = 0; j < joints(); ++j) sum += stops.energy(j, q[7 + j]);
    return sum;
  }

  // Adds dt of every power at the evaluated state to the ledger.
  void add_to(EnergyLedger& ledger, const VectorXd& v, const VectorXd& torque, double dt) const {
    ledger.servo += dt * torque.dot(v.tail(joints()));
    ledger.joint_damping += dt * v.tail(joints()).cwiseAbs2().dot(servo.damping);
    for (int j = 0; j < joints(); ++j) ledger.stops -= dt * stop[j].torque * v[6 + j];
    for (std::size_t i = 0; i < feet.size(); ++i)
      if (feet[i].active)
        ledger.add_contact(i, feet[i].contact.force, feet[i].velocity, feet[i].ground.normal, dt);
  }

  // v' at the evaluated state under the given servo torques.
  void acceleration(const VectorXd& v, const VectorXd& torque, VectorXd& out) {
    out = -bias();
    out.tail(joints()) += torque - servo.damping.cwiseProduct(v.tail(joints()));
    for (int j = 0; j < joints(); ++j) out[6 + j] += stop[j].torque;
    for (std::size_t i = 0; i < feet.size(); ++i)
      if (feet[i].active) add_transposed(i, feet[i].contact.force, out);
    system.load(mass_upper());
    system.factor();
    system.solve(out);
  }

  Dynamics dynamics;
  Tree tree;
  std::vector<FootMount> mounts;
  ContactLaw law;
  Terrain terrain;
  Servo servo;
  JointStops stops;
  System system;
  bool look_ahead = false;  // feet out of contact have velocities and Jacobians too
  std::size_t per_foot;    // contacts a foot can have at once
  std::vector<Foot> feet;  // contacts: those of foot f are f * per_foot ...
  std::vector<StopPush> stop;  // of each joint, at the evaluated state
  Vec3 ground_velocity = Vec3::Zero();
  long evaluations = 0;

 private:
  const std::vector<std::size_t>& columns(std::size_t i) const { return columns_[foot_of(i)]; }

  void place_foot(std::size_t f, double t, const VectorXd& q, const VectorXd& v, double lead) {
    const FootMount& mount = mounts[f];
    const Vec3 center = dynamics.point(mount.joint, mount.offset), world = q.head<3>() + center;
    GroundPoints points;
    terrain.under(world, mount.radius, t, points);
    if (per_foot == 2) keep_order(feet[2 * f], feet[2 * f + 1], points);
    for (std::size_t k = 0; k < per_foot; ++k) {
      Foot& foot = feet[f * per_foot + k];
      foot.center = center;
      foot.ground = points[k];
      foot.active = foot.ground.gap < 0.0;
      foot.contact = ContactForce();
      const bool seen = look_ahead || law.normal.needs_touch_speed();
      if (foot.active || (seen && foot.ground.gap < kFarAway))
        differentiate_foot(f * per_foot + k, v);
      if (foot.active) load_foot(foot, world, lead);
    }
  }

  // A contact that goes on keeps its place, and with it its memory, when the faces change.
  static void keep_order(const Foot& first, const Foot& second, GroundPoints& points) {
    const auto alike = [](const Foot& old, const GroundPoint& point) {
      return old.memory.touching && point.gap < kFarAway ? old.ground.normal.dot(point.normal) : -1.0;
    };
    const double kept = alike(first, points[0]) + alike(second, points[1]);
    if (alike(first, points[1]) + alike(second, points[0]) > kept) std::swap(points[0], points[1]);
  }

  void load_foot(Foot& foot, const Vec3& world, double lead) {
    if (!foot.memory.touching && foot.memory.touch_speed <= 0.0)  // never seen free
      foot.memory.touch_speed = std::max(0.0, -foot.ground.normal.dot(foot.velocity));
    if (!terrain.patches.empty())
      std::tie(foot.mu_scale, foot.k_scale) = terrain.factors(world.x(), world.y());
    foot.contact = contact_force(law, foot.ground, foot.velocity, foot.memory, lead, foot.mu_scale,
                                 foot.k_scale);
  }

  // J: velocity of the contact point; Q: its derivative to the chart coordinates, with the point of
  // contact staying below the centre while the link turns.
  void differentiate_foot(std::size_t i, const VectorXd& v) {
    Foot& foot = feet[i];
    const FootMount& mount = mounts[foot_of(i)];
    const std::vector<std::size_t>& joints = columns(i);
    const Vec3 arm = -mount.radius * foot.ground.normal;
    const Mat3& rotation = dynamics.base_rotation();
    const Vec3 point = foot.center + arm;
    Vec3 spin = rotation * v.template segment<3>(3);
    Vec3 at_center = rotation * v.template head<3>() + spin.cross(foot.center);
    for (int k = 0; k < 3; ++k) {
      foot.jb.col(k) = rotation.col(k);
      foot.jb.col(3 + k) = rotation.col(k).cross(point);
    }
    for (std::size_t k = 0; k < joints.size(); ++k) {
      const std::size_t j = joints[k];
      if (j > mount.joint) break;
      const Vec3 &z = dynamics.axis(j), lever = foot.center - dynamics.origin(j);
      const double rate = v[Tree::column(j)];
      foot.jl.col(k) = z.cross(lever + arm);
      // first the parent's part; the part of the foot's own velocity follows when it is known
      foot.ql.col(k) = spin.cross(z.cross(lever)) - z.cross(at_center) + z.cross(spin).cross(arm) * -1.0;
      at_center += z.cross(lever) * rate;
      spin += z * rate;
    }
    foot.velocity = at_center + spin.cross(arm) - ground_velocity;
    foot.qb.template leftCols<3>().setZero();
    const double spin_arm = spin.dot(arm);
    for (int k = 0; k < 3; ++k) {  // (e x spin) x arm = spin (e.arm) - e (spin.arm)
      const auto e = rotation.col(k);
      foot.qb.col(3 + k) = e.cross(at_center) + spin * e.dot(arm) - e * spin_arm;
    }
    for (std::size_t k = 0; k < joints.size() && joints[k] <= mount.joint; ++k) {
      const Vec3& z = dynamics.axis(joints[k]);
      foot.ql.col(k) += z.cross(at_center) + z.cross(spin).cross(arm);
    }
  }

  struct Kept {
    Eigen::MatrixXd mass;
    VectorXd bias, v;
    std::vector<Foot> feet;
    std::vector<StopPush> stop;
  };

  void swap_kept() {
    dynamics.swap_results(kept_.mass, kept_.bias);
    v_.swap(kept_.v);
    feet.swap(kept_.feet);
    stop.swap(kept_.stop);
  }

  VectorXd q_local_, v_;
  Kept kept_;
  std::vector<std::vector<std::size_t>> columns_;
};

}  // namespace hexapod
