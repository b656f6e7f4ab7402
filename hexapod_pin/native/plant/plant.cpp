#include "plant/plant.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "plant/arrow.hpp"
#include "plant/contact_kinematics.hpp"
#include "plant/contact_order.hpp"
#include "plant/dense.hpp"
#include "plant/prescribed_system.hpp"

namespace hexapod {

template <class SystemT>
Plant<SystemT>::Plant(const Dynamics& body, std::vector<FootMount> mounts, ContactLaw law, Terrain terrain,
                      DriveLaw drive)
    : dynamics(body), tree(body.tree()), mounts(std::move(mounts)), law(law), terrain(std::move(terrain)),
      drive(std::move(drive)), dry(!kPrescribed && this->drive.dry()),
      needs_external(this->drive.needs_external()), system(tree, this->mounts),
      per_foot(this->terrain.max_contacts()), feet(this->mounts.size() * per_foot), stop(tree.nv - 6),
      mode(tree.nv - 6), holding(VectorXd::Zero(tree.nv - 6)), external(holding), gear_slopes(tree.nv - 6),
      drive_counters(tree.nv - 6),
      q_local_(VectorXd::Zero(tree.nq)) {
  for (const FootMount& mount : this->mounts) columns_.push_back(system.columns(tree, mount));
  for (std::size_t i = 0; i < feet.size(); ++i) {
    feet[i].jl.setZero(3, System::kLegColumns == Eigen::Dynamic ? columns(i).size() : 3);
    feet[i].ql = feet[i].jl;
  }
  v_.setZero(tree.nv);
  push_force_ = v_;
  saved_.dynamics = {Eigen::MatrixXd::Zero(tree.nv, tree.nv), v_};
  saved_.push_force = saved_.v = v_, saved_.feet = feet, saved_.stop = stop;
}

template <class SystemT>
Plant<SystemT>::Plant(Plant&&) = default;

template <class SystemT>
Plant<SystemT>::~Plant() = default;

template <class SystemT>
void Plant<SystemT>::evaluate(double t, const VectorXd& q, const VectorXd& v, double implicit_dt) {
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

template <class SystemT>
void Plant<SystemT>::save_evaluation() {
  swap_saved();
  for (std::size_t i = 0; i < feet.size(); ++i) {
    feet[i].memory = saved_.feet[i].memory;
    feet[i].ground = saved_.feet[i].ground;
  }
}

template <class SystemT>
void Plant<SystemT>::set_implicit_dt(const VectorXd& q, double implicit_dt) {
  if (!law.friction.has_bristle()) return;
  for (Contact& foot : feet)
    if (foot.active) find_force(foot, q.head<3>() + foot.center, implicit_dt);
}

template <class SystemT>
void Plant<SystemT>::update_memories() {
  for (Contact& foot : feet) {
    const bool begun = foot.active && !foot.memory.touching, unseen = !(foot.memory.free_gap < kFarAway);
    const bool located =
        begun && (unseen || -foot.ground.gap < std::min(located_depth, foot.memory.free_gap));
    if (foot.active) foot.memory.stand_on(foot.ground);
    else if (foot.memory.touching) foot.memory.reset();
    if ((!foot.active || located) && law.normal.needs_touch_speed())
      foot.memory.touch_speed =
          foot.ground.gap < kFarAway ? std::max(0.0, -foot.ground.normal.dot(foot.velocity)) : 0.0;
    if (!foot.active) foot.memory.free_gap = foot.ground.gap;
  }
  if (pieces_frozen) update_pieces();
}

template <class SystemT>
Vec3 Plant<SystemT>::law_force(const Contact& foot) const {
  if (!foot.active) return Vec3::Zero();
  return contact_force(law, foot.ground, foot.velocity, foot.memory, 0.0, foot.mu_scale, foot.k_scale)
      .force;
}

template <class SystemT>
double Plant<SystemT>::pressing_force(const Contact& foot) const {
  const double rate = -foot.ground.normal.dot(foot.velocity);
  return foot.k_scale *
         law.normal(-foot.ground.gap, rate, foot.memory.touch_speed, NormalPiece::pressing).force;
}

template <class SystemT>
double Plant<SystemT>::piece_margin(const Contact& foot) const {
  const Vec3& n = foot.ground.normal;
  const double normal = foot.active ? n.dot(foot.contact.force) : 0.0;
  const Vec3 trial = law.friction.bristle_stiffness * in_plane(n, foot.memory.stretch) +
                     law.friction.bristle_gain(0.0) * in_plane(n, foot.velocity);
  return hexapod::piece_margin(law.friction, foot.mu_scale, normal, trial.norm(), foot.memory.sliding);
}

template <class SystemT>
void Plant<SystemT>::begin_loads(double t) {
  pushes_.select(loads, t);
  push_force_.setZero(tree.nv);
  for (const LostDrive& lost : loads.lost)
    if (Loads::reached(lost.time, t)) drive.disable(lost.joint);
}

template <class SystemT>
double Plant<SystemT>::kinetic_energy(const VectorXd& v) const {  // the upper triangle holds all of M
  double twice = 0.0;
  for (int c = 0; c < tree.nv; ++c)
    twice += v[c] * (2.0 * mass_upper().col(c).head(c).dot(v.head(c)) + mass_upper()(c, c) * v[c]);
  return 0.5 * twice;
}

template <class SystemT>
void Plant<SystemT>::find_modes(const VectorXd& q, const VectorXd& v, const VectorXd& demand) {
  for (int j = 0; j < joints(); ++j) mode[j] = drive.mode(j, q[7 + j], v[6 + j], demand[j]);
  if (modes_frozen) find_stops(q, v);
  if (!dry) return;
  VectorXd torque(joints()), rate(tree.nv);
  for (int j = 0; j < joints(); ++j)
    torque[j] = drive.torque_on(j, mode[j].limit, demand[j], v[6 + j]);
  find_slipping(v, torque, rate);
}

template <class SystemT>
void Plant<SystemT>::find_slipping(const VectorXd& v, const VectorXd& torque, VectorXd& out) {
  const int most = kBlockPasses + 4 * joints();
  for (int pass = 0; pass <= most; ++pass) {
    acceleration(v, torque, out);
    bool changed = false;
    for (int j = 0; j < joints() && !(changed && pass >= kBlockPasses); ++j) {
      if (!drive.has_friction(j) || v[6 + j] != 0.0) continue;
      const FrictionMode now = mode[j].friction, next = friction_from_rest(j, out[6 + j], torque[j]);
      mode[j].friction = next;
      changed |= next != now;
    }
    if (!changed) return;
  }
}

template <class SystemT>
bool Plant<SystemT>::stop_turned_back(VectorXd& v) const {
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

template <class SystemT>
double Plant<SystemT>::inertial_torque(int joint, const VectorXd& acceleration) const {
  const int c = 6 + joint, after = tree.nv - c - 1;
  return mass_upper().col(c).head(c + 1).dot(acceleration.head(c + 1)) +
         mass_upper().row(c).tail(after).dot(acceleration.tail(after));
}

template <class SystemT>
double Plant<SystemT>::stored_in_stops(const VectorXd& q) const {
  double sum = 0.0;
  for (int j = 0; j < joints(); ++j) sum += drive.stops.energy(j, q[7 + j]);
  return sum;
}

template <class SystemT>
void Plant<SystemT>::accumulate(EnergyLedger& ledger, const VectorXd& v, const VectorXd& torque,
                                double dt) const {
  ledger.servo += dt * torque.dot(v.tail(joints()));
  ledger.push += dt * push_power(v);
  ledger.joint_damping += dt * v.tail(joints()).cwiseAbs2().dot(drive.damping);
  VectorXd own;
  if (kPrescribed && needs_external) find_external(own);
  const VectorXd& load = own.size() > 0 ? own : external;
  if (dry || kPrescribed)
    for (int j = 0; j < joints(); ++j) {
      const FrictionMode friction = kPrescribed ? drive.sliding(j, v[6 + j]) : mode[j].friction;
      ledger.joint_damping -= dt * drive.dry_torque(j, friction, torque[j], v[6 + j], load[j]) * v[6 + j];
    }
  for (int j = 0; j < joints(); ++j) ledger.stops -= dt * stop[j].torque * v[6 + j];
  for (std::size_t i = 0; i < feet.size(); ++i)
    if (feet[i].active)
      ledger.add_contact(i, feet[i].contact.force, feet[i].velocity, feet[i].ground.normal, dt);
}

template <class SystemT>
void Plant<SystemT>::acceleration(const VectorXd& v, const VectorXd& torque, VectorXd& out) {
  out = -bias();
  out.tail(joints()) += torque - drive.damping.cwiseProduct(v.tail(joints()));
  for (int j = 0; j < joints(); ++j) out[6 + j] += stop[j].torque;
  for (std::size_t i = 0; i < feet.size(); ++i)
    if (feet[i].active) add_jacobian_transposed(i, feet[i].contact.force, out);
  system.load(mass_upper());
  if (needs_external && dry) find_external(external);
  if (dry)
    for (int j = 0; j < joints(); ++j) {
      out[6 + j] += drive.dry_torque(j, mode[j].friction, torque[j], v[6 + j], external[j]);
      gear_slopes[j] = drive.gear_response(j, mode[j].friction, torque[j], v[6 + j], external[j]);
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

template <class SystemT>
inline void Plant<SystemT>::update_pieces() {
  bool changed = false;
  for (Contact& foot : feet) {
    const ContactMemory old = foot.memory;
    if (!terrain.patches.empty()) {
      ContactMemory& m = foot.memory;
      const double x = center(foot).x(), y = center(foot).y();
      const bool known = foot.active && m.left != kUnseenPatch;
      const int now = known ? terrain.patch_after(m.patch, m.left, x, y) : terrain.patch_at(x, y);
      if (!known) m.left = kNoPatch;
      else if (now != m.patch) m.left = m.patch;
      m.patch = now;
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

template <class SystemT>
inline bool Plant<SystemT>::would_slide(const Contact& foot) const {
  const Vec3& n = foot.ground.normal;
  const double first = foot.k_scale * law.normal.first_force(-n.dot(foot.velocity));
  const double trial = law.friction.bristle_gain(0.0) * in_plane(n, foot.velocity).norm();
  return hexapod::piece_margin(law.friction, foot.mu_scale, first, trial, false) <= 0.0;
}

// Most of an evaluation: small functions are a call each where the compiler does not inline them.
template <class SystemT>
[[gnu::flatten]] void Plant<SystemT>::place_foot(std::size_t f, double t, const VectorXd& q,
                                                 const VectorXd& v, double implicit_dt) {
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

template <class SystemT>
inline void Plant<SystemT>::find_force(Contact& foot, const Vec3& world, double implicit_dt) {
  // A foot that was never seen free, or was at rest above the ground, takes the speed that it has here. One
  // that stood on the ground but for rounding keeps the speed 0.
  if (!foot.memory.touching && foot.memory.touch_speed <= 0.0 && foot.memory.free_gap > kStanding)
    foot.memory.touch_speed = std::max(0.0, -foot.ground.normal.dot(foot.velocity));
  if (!terrain.patches.empty()) {
    if (!pieces_frozen) foot.memory.patch = terrain.patch_at(world.x(), world.y());
    std::tie(foot.mu_scale, foot.k_scale) = terrain.patch_factors(foot.memory.patch);
  }
  foot.contact = contact_force(law, foot.ground, foot.velocity, foot.memory, implicit_dt,
                               foot.mu_scale, foot.k_scale, pieces_frozen);
}

template <class SystemT>
inline FrictionMode Plant<SystemT>::friction_from_rest(int j, double acceleration, double motor) const {
  const FrictionMode now = mode[j].friction;
  if (now == FrictionMode::forward) return acceleration < 0.0 ? FrictionMode::stuck : now;
  if (now == FrictionMode::backward) return acceleration > 0.0 ? FrictionMode::stuck : now;
  if (!(std::abs(holding[j]) > drive.holding_limit(j, motor, holding[j], external[j]))) return now;
  return holding[j] > 0.0 ? FrictionMode::forward : FrictionMode::backward;
}

template <class SystemT>
inline void Plant<SystemT>::swap_saved() {
  dynamics.swap_results(saved_.dynamics);
  push_force_.swap(saved_.push_force);
  v_.swap(saved_.v);
  base_.swap(saved_.base);
  feet.swap(saved_.feet);
  stop.swap(saved_.stop);
}

template class Plant<ArrowSystem>;
template class Plant<DenseSystem>;
template class Plant<PrescribedSystem>;

}  // namespace hexapod
