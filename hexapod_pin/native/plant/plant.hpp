// The robot on its ground: mass matrix, bias, feet with Jacobians, servos, at one state (q, v).
#pragma once

#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

#include "laws/contact.hpp"
#include "laws/drive.hpp"
#include "laws/terrain.hpp"
#include "plant/contact_kinematics.hpp"
#include "plant/contact_order.hpp"
#include "plant/contact_state.hpp"
#include "plant/drive_counters.hpp"
#include "plant/dynamics.hpp"
#include "plant/energy_ledger.hpp"
#include "plant/loads.hpp"
#include "plant/mount.hpp"
#include "plant/set_points.hpp"

namespace hexapod {

constexpr double kLocatedTouchDepth = 2e-7;  // m; touch-downs that were located are less deep

template <class SystemT>
class Plant {
 public:
  using System = SystemT;
  static constexpr bool kPrescribed = System::kPrescribed;  // joints follow a given motion
  using Contact = ContactState<typename System::LegJacobian>;

  Plant(const Dynamics& body, std::vector<FootMount> mounts, ContactLaw law, Terrain terrain,
        DriveLaw drive)
      : dynamics(body), tree(body.tree()), mounts(std::move(mounts)), law(law),
        terrain(std::move(terrain)), drive(std::move(drive)), dry(!kPrescribed && this->drive.dry()),
        system(tree, this->mounts), per_foot(this->terrain.max_contacts()),
        feet(this->mounts.size() * per_foot), stop(tree.nv - 6), mode(tree.nv - 6),
        holding(VectorXd::Zero(tree.nv - 6)), drive_counters(tree.nv - 6),
        q_local_(VectorXd::Zero(tree.nq)) {
    for (const FootMount& mount : this->mounts) columns_.push_back(system.columns(tree, mount));
    for (std::size_t i = 0; i < feet.size(); ++i) {
      feet[i].jl.setZero(3, System::kLegColumns == Eigen::Dynamic ? columns(i).size() : 3);
      feet[i].ql = feet[i].jl;
    }
    v_.setZero(tree.nv);
    push_force_ = v_;
    saved_ = {Eigen::MatrixXd::Zero(tree.nv, tree.nv), v_, v_, v_, base_, feet, stop};
  }

  // Everything below refers to the state of the last call. Dynamics do not depend on the base
  // position, so they are evaluated with the base at the origin: no precision is lost far from the origin.
  // `implicit_dt` is the step of a method that takes contact forces at its end, else 0.
  void evaluate(double t, const VectorXd& q, const VectorXd& v, double implicit_dt) {
    q_local_.tail(tree.nq - 3) = q.tail(tree.nq - 3);
    base_ = q.head<3>();
    v_ = v;
    dynamics.compute(q_local_, v);
    if (pushes_.any()) {
      pushes_.find(loads, dynamics, push_force_);
      dynamics.subtract_from_bias(push_force_);
    }
    ground_velocity = Vec3(0.0, 0.0, terrain.surface_speed(t));
    for (std::size_t f = 0; f < mounts.size(); ++f) place_foot(f, t, q, v, implicit_dt);
    find_stops(q, v);
    ++evaluations;
  }

  // The stops' torques of the evaluated state again, its modes having changed.
  void find_stops(const VectorXd& q, const VectorXd& v) {
    for (int j = 0; j < joints(); ++j)
      stop[j] = modes_frozen ? drive.stops.on(j, mode[j].stop, q[7 + j], v[6 + j])
                             : drive.stops(j, q[7 + j], v[6 + j]);
  }

  // Saves what solving needs of the evaluated state while others are evaluated.
  void save_evaluation() {
    swap_saved();
    for (std::size_t i = 0; i < feet.size(); ++i) {
      feet[i].memory = saved_.feet[i].memory;
      feet[i].ground = saved_.feet[i].ground;
    }
  }
  void restore_evaluation() { swap_saved(); }

  // The contact forces again, for another step at whose end they are taken; q as in the last call.
  void set_implicit_dt(const VectorXd& q, double implicit_dt) {
    if (!law.friction.has_bristle()) return;
    for (Contact& foot : feet)
      if (foot.active) find_force(foot, q.head<3>() + foot.center, implicit_dt);
  }

  // At an accepted state: contacts that have begun or ended change their memory. The touch speed is
  // that of the last state out of the ground, or of the first in it where that is a located touch-down and
  // nearer to the surface, or where the face was not there before.
  void update_memories() {
    for (Contact& foot : feet) {
      const bool begun = foot.active && !foot.memory.touching, unseen = !(foot.memory.free_gap < kFarAway);
      const bool located =
          begun && (unseen || -foot.ground.gap < std::min(kLocatedTouchDepth, foot.memory.free_gap));
      if (foot.active) foot.memory.stand_on(foot.ground);
      else if (foot.memory.touching) foot.memory.reset();
      if ((!foot.active || located) && law.normal.needs_touch_speed())
        foot.memory.touch_speed =
            foot.ground.gap < kFarAway ? std::max(0.0, -foot.ground.normal.dot(foot.velocity)) : 0.0;
      if (!foot.active) foot.memory.free_gap = foot.ground.gap;
    }
    if (pieces_frozen) update_pieces();
  }

  // Force of the law on a contact at the evaluated state, whatever step a method takes forces over, N: it
  // never pulls and is inside the friction cone.
  Vec3 law_force(const Contact& foot) const {
    if (!foot.active) return Vec3::Zero();
    return contact_force(law, foot.ground, foot.velocity, foot.memory, 0.0, foot.mu_scale, foot.k_scale)
        .force;
  }

  // Normal force of an active contact at the evaluated state, were it not cut off at zero, N.
  double pressing_force(const Contact& foot) const {
    const double rate = -foot.ground.normal.dot(foot.velocity);
    return foot.k_scale *
           law.normal(-foot.ground.gap, rate, foot.memory.touch_speed, NormalPiece::pressing).force;
  }

  // Margin of the piece of the law that a bristle is in, N; without a normal force it slides.
  double piece_margin(const Contact& foot) const {
    const Vec3& n = foot.ground.normal;
    const double normal = foot.active ? n.dot(foot.contact.force) : 0.0;
    const Vec3 trial = law.friction.bristle_stiffness * in_plane(n, foot.memory.stretch) +
                       law.friction.bristle_gain(0.0) * in_plane(n, foot.velocity);
    return hexapod::piece_margin(law.friction, foot.mu_scale, normal, trial.norm(), foot.memory.sliding);
  }

  // Pushes that act from time t on; drives that have failed by then lose their torque. Nothing changes
  // before `loads.next_change(t)`.
  void begin_loads(double t) {
    pushes_.select(loads, t);
    push_force_.setZero(tree.nv);
    for (const LostDrive& lost : loads.lost)
      if (Loads::reached(lost.time, t)) drive.disable(lost.joint);
  }
  // Power of the pushes at the evaluated state where it moves at v, W.
  template <class Velocity>
  double push_power(const Velocity& v) const { return pushes_.any() ? push_force_.dot(v) : 0.0; }

  const Eigen::MatrixXd& mass_upper() const { return dynamics.mass_upper(); }
  const VectorXd& bias() const { return dynamics.bias(); }  // C v + g, less the pushes
  int joints() const { return tree.nv - 6; }
  double rate(int joint) const { return v_[6 + joint]; }
  Vec3 center_of_mass() const { return dynamics.center_of_mass(); }  // relative to the base origin

  double kinetic_energy(const VectorXd& v) const {  // the upper triangle holds all of M
    double twice = 0.0;
    for (int c = 0; c < tree.nv; ++c)
      twice += v[c] * (2.0 * mass_upper().col(c).head(c).dot(v.head(c)) + mass_upper()(c, c) * v[c]);
    return 0.5 * twice;
  }

  Vec3 center(const Contact& foot) const { return base_ + foot.center; }  // of its sphere, m, world axes
  std::size_t foot_of(std::size_t contact) const { return contact / per_foot; }
  // joints that move a contact
  const std::vector<std::size_t>& columns(std::size_t i) const { return columns_[foot_of(i)]; }

  template <class Force>
  void add_jacobian_transposed(std::size_t i, const Force& f, VectorXd& out) const {
    const Contact& foot = feet[i];
    out.head<6>().noalias() += foot.jb.transpose() * f;
    for (std::size_t k = 0; k < columns(i).size(); ++k)
      out[Tree::column(columns(i)[k])] += foot.jl.col(k).dot(f);
  }

  // [xb xl] v for a contact's 3 x (6 + leg) matrix, e.g. (jb, jl) or (qb, ql)
  EIGEN_ALWAYS_INLINE Vec3 jacobian_times(std::size_t i, const Eigen::Matrix<double, 3, 6>& xb,
                                          const typename System::LegJacobian& xl,
                                          const VectorXd& v) const {
    Vec3 sum = xb * v.head<6>();
    for (std::size_t k = 0; k < columns(i).size(); ++k)
      sum += xl.col(k) * v[Tree::column(columns(i)[k])];
    return sum;
  }

  // Energy stored in a contact's normal spring and in its bristle, J.
  double stored_normal(const Contact& foot) const {
    return foot.k_scale * law.normal.energy(-foot.ground.gap);
  }
  double stored_bristle(const Contact& foot) const {
    return law.friction.bristle_energy(in_plane(foot.ground.normal, foot.memory.stretch).squaredNorm());
  }

  // Servo torques before their limits at a state (q, v) for set-points.
  void servo_demand(const VectorXd& q, const VectorXd& v, const SetPoints& to,
                    VectorXd& demand) const {
    for (int j = 0; j < joints(); ++j)
      demand[j] = drive.demand(j, to.q[j] - q[7 + j], to.v[j] - v[6 + j], to.torque[j]);
  }

  // Motor torques at a state for demands: in the modes where they are frozen, else by the law.
  void motor_torque(const VectorXd& v, const VectorXd& demand, VectorXd& torque) const {
    for (int j = 0; j < joints(); ++j)
      torque[j] = modes_frozen ? drive.torque_on(j, mode[j].limit, demand[j], v[6 + j])
                               : drive.motor_torque(j, demand[j], v[6 + j]);
  }

  // Motor torques at a state for set-points, by the law.
  void servo_torque(const VectorXd& q, const VectorXd& v, const SetPoints& to,
                    VectorXd& torque) const {
    servo_demand(q, v, to, torque);
    for (int j = 0; j < joints(); ++j) torque[j] = drive.motor_torque(j, torque[j], v[6 + j]);
  }

  // The modes of the evaluated state under these demands. Joints at rest with dry friction slip where
  // what they must hold exceeds it; that depends on which others slip, so it is found by solving again.
  void find_modes(const VectorXd& q, const VectorXd& v, const VectorXd& demand) {
    for (int j = 0; j < joints(); ++j) mode[j] = drive.mode(j, q[7 + j], v[6 + j], demand[j]);
    if (modes_frozen) find_stops(q, v);
    if (!dry) return;
    VectorXd torque(joints()), rate(tree.nv);
    for (int j = 0; j < joints(); ++j)
      torque[j] = drive.torque_on(j, mode[j].limit, demand[j], v[6 + j]);
    find_slipping(v, torque, rate);
  }

  // Joints at rest with dry friction under the given motor torques: those that the torques left to them
  // break loose, and v' in `out`. A complementarity problem, by block pivoting and then, where that goes
  // round in circles, by Murty's rule of the least index.
  void find_slipping(const VectorXd& v, const VectorXd& torque, VectorXd& out) {
    const int most = kBlockPasses + 4 * joints();
    for (int pass = 0; pass <= most; ++pass) {
      acceleration(v, torque, out);
      bool changed = false;
      for (int j = 0; j < joints() && !(changed && pass >= kBlockPasses); ++j) {
        if (!(drive.friction[j] > 0.0) || v[6 + j] != 0.0) continue;
        const FrictionMode now = mode[j].friction, next = friction_from_rest(j, out[6 + j]);
        mode[j].friction = next;
        changed |= next != now;
      }
      if (!changed) return;
    }
  }

  // Joints whose rate has passed zero under dry friction are at rest; whether they stay so is found with
  // the next modes. True if there are any.
  bool stop_turned_back(VectorXd& v) const {
    bool found = false;
    for (int j = 0; dry && j < joints(); ++j) {
      const FrictionMode friction = mode[j].friction;
      const double rate = v[6 + j];
      if (!(friction == FrictionMode::forward && rate < 0.0) &&
          !(friction == FrictionMode::backward && rate > 0.0))
        continue;
      v[6 + j] = 0.0;
      found = true;
    }
    return found;
  }

  // A row of M times the accelerations (nv), N m.
  double inertial_torque(int joint, const VectorXd& acceleration) const {
    const int c = 6 + joint, after = tree.nv - c - 1;
    return mass_upper().col(c).head(c + 1).dot(acceleration.head(c + 1)) +
           mass_upper().row(c).tail(after).dot(acceleration.tail(after));
  }

  double stored_in_stops(const VectorXd& q) const {
    double sum = 0.0;
    for (int j = 0; j < joints(); ++j) sum += drive.stops.energy(j, q[7 + j]);
    return sum;
  }

  // Adds dt of every power at the evaluated state to the ledger.
  void accumulate(EnergyLedger& ledger, const VectorXd& v, const VectorXd& torque,
                  double dt) const {
    ledger.servo += dt * torque.dot(v.tail(joints()));
    ledger.push += dt * push_power(v);
    ledger.joint_damping += dt * v.tail(joints()).cwiseAbs2().dot(drive.damping);
    if (dry || kPrescribed)
      for (int j = 0; j < joints(); ++j) {
        const FrictionMode friction = kPrescribed ? drive.sliding(j, v[6 + j]) : mode[j].friction;
        ledger.joint_damping -= dt * drive.dry_torque(j, friction) * v[6 + j];
      }
    for (int j = 0; j < joints(); ++j) ledger.stops -= dt * stop[j].torque * v[6 + j];
    for (std::size_t i = 0; i < feet.size(); ++i)
      if (feet[i].active)
        ledger.add_contact(i, feet[i].contact.force, feet[i].velocity, feet[i].ground.normal, dt);
  }

  // v' at the evaluated state under the given motor torques. A stuck joint has none; what it must hold
  // is left in `holding`.
  void acceleration(const VectorXd& v, const VectorXd& torque, VectorXd& out) {
    out = -bias();
    out.tail(joints()) += torque - drive.damping.cwiseProduct(v.tail(joints()));
    for (int j = 0; j < joints(); ++j) out[6 + j] += stop[j].torque;
    for (std::size_t i = 0; i < feet.size(); ++i)
      if (feet[i].active) add_jacobian_transposed(i, feet[i].contact.force, out);
    system.load(mass_upper());
    if (dry)
      for (int j = 0; j < joints(); ++j) {
        out[6 + j] += drive.dry_torque(j, mode[j].friction);
        if (mode[j].stuck()) system.add_diagonal(j, kLock);
      }
    system.factor();
    system.solve(out);
    if (dry)
      for (int j = 0; j < joints(); ++j) {
        if (!mode[j].stuck()) continue;
        holding[j] = kLock * out[6 + j];
        out[6 + j] = 0.0;
      }
  }

  Dynamics dynamics;
  Tree tree;
  std::vector<FootMount> mounts;
  ContactLaw law;
  Terrain terrain;
  DriveLaw drive;
  bool dry;  // a joint that is driven has dry friction
  Loads loads;
  System system;
  bool differentiates_separated = false;  // feet out of contact have velocities and Jacobians too
  std::size_t per_foot;    // contacts a foot can have at once
  std::vector<Contact> feet;  // contacts: those of foot f are f * per_foot ...
  std::vector<StopTorque> stop;  // of each joint, at the evaluated state
  std::vector<DriveMode> mode;   // of each joint, as last found
  bool modes_frozen = false;     // motors and stops stay in their modes beyond the modes' ends
  // Contacts keep pressing or are released, stuck or sliding, and on their patch, as they remember.
  bool pieces_frozen = false;
  VectorXd holding;              // torque that stuck joints must hold, N m
  DriveCounters drive_counters;
  Vec3 ground_velocity = Vec3::Zero();
  long evaluations = 0;

 private:
  // Moves contacts at the evaluated state to the piece of the law that holds there; feet in the air slide.
  void update_pieces() {
    bool changed = false;
    for (Contact& foot : feet) {
      const ContactMemory old = foot.memory;
      if (!terrain.patches.empty()) {
        foot.memory.patch = terrain.patch_at(center(foot).x(), center(foot).y());
        std::tie(foot.mu_scale, foot.k_scale) = terrain.patch_factors(foot.memory.patch);
      }
      if (law.friction.has_bristle())
        foot.memory.sliding =
            foot.active ? old.sliding == (piece_margin(foot) >= 0.0) : would_slide(foot);
      foot.memory.released = foot.active && !(pressing_force(foot) > 0.0);
      changed |= foot.memory.patch != old.patch || foot.memory.sliding != old.sliding ||
                 foot.memory.released != old.released;
    }
    if (!changed) return;
    for (Contact& foot : feet)
      if (foot.active) find_force(foot, center(foot), 0.0);
  }

  // Whether a separated contact slides from its first touch on, were that now: what its bristle would take
  // is not within the static cone of the force that contact begins with, which is mostly zero.
  bool would_slide(const Contact& foot) const {
    const Vec3& n = foot.ground.normal;
    const double first = foot.k_scale * law.normal.first_force(-n.dot(foot.velocity));
    const double trial = law.friction.bristle_gain(0.0) * in_plane(n, foot.velocity).norm();
    return hexapod::piece_margin(law.friction, foot.mu_scale, first, trial, false) <= 0.0;
  }

  void place_foot(std::size_t f, double t, const VectorXd& q, const VectorXd& v, double implicit_dt) {
    const FootMount& mount = mounts[f];
    const Vec3 center = dynamics.point(mount.joint, mount.offset), world = q.head<3>() + center;
    GroundPoints points;
    terrain.find_contacts(world, mount.radius, t, points);
    if (per_foot == 2) {
      put_treads_first(points);
      keep_order(feet[2 * f], feet[2 * f + 1], points);
    }
    for (std::size_t k = 0; k < per_foot; ++k) {
      Contact& foot = feet[f * per_foot + k];
      foot.center = center;
      foot.ground = points[k];
      foot.active = foot.ground.gap < 0.0;
      foot.contact = ContactForce();
      const bool wanted = differentiates_separated || law.normal.needs_touch_speed();
      if (foot.active || (wanted && foot.ground.gap < kFarAway))
        differentiate_contact(dynamics, mount, columns_[f], v, ground_velocity, foot);
      if (foot.active) find_force(foot, world, implicit_dt);
    }
  }

  void find_force(Contact& foot, const Vec3& world, double implicit_dt) {
    if (!foot.memory.touching && foot.memory.touch_speed <= 0.0)  // never seen free
      foot.memory.touch_speed = std::max(0.0, -foot.ground.normal.dot(foot.velocity));
    if (!terrain.patches.empty()) {
      if (!pieces_frozen) foot.memory.patch = terrain.patch_at(world.x(), world.y());
      std::tie(foot.mu_scale, foot.k_scale) = terrain.patch_factors(foot.memory.patch);
    }
    foot.contact = contact_force(law, foot.ground, foot.velocity, foot.memory, implicit_dt,
                                 foot.mu_scale, foot.k_scale, pieces_frozen);
  }

  // What a joint at rest does, by what it must hold or by how it has been found to accelerate.
  FrictionMode friction_from_rest(int j, double acceleration) const {
    const FrictionMode now = mode[j].friction;
    if (now == FrictionMode::forward) return acceleration < 0.0 ? FrictionMode::stuck : now;
    if (now == FrictionMode::backward) return acceleration > 0.0 ? FrictionMode::stuck : now;
    if (!(std::abs(holding[j]) > drive.friction[j])) return now;
    return holding[j] > 0.0 ? FrictionMode::forward : FrictionMode::backward;
  }

  struct SavedEvaluation {
    Eigen::MatrixXd mass;
    VectorXd bias, push_force, v;
    Vec3 base;
    std::vector<Contact> feet;
    std::vector<StopTorque> stop;
  };

  void swap_saved() {
    dynamics.swap_results(saved_.mass, saved_.bias);
    push_force_.swap(saved_.push_force);
    v_.swap(saved_.v);
    base_.swap(saved_.base);
    feet.swap(saved_.feet);
    stop.swap(saved_.stop);
  }

  static constexpr int kBlockPasses = 4;

  PushForce pushes_;
  VectorXd push_force_;
  VectorXd q_local_, v_;
  Vec3 base_ = Vec3::Zero();  // position of the evaluated state, m
  SavedEvaluation saved_;
  std::vector<std::vector<std::size_t>> columns_;
};

}  // namespace hexapod
