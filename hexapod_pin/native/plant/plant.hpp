// The robot on its ground: mass matrix, bias, feet with Jacobians, servos, at one state (q, v).
// What is not defined here is compiled once for each linear system, in plant.cpp; so are other templates
// over plants. Their private helpers are `inline` there, as they would be in the class.
#pragma once

#include <vector>

#include "laws/contact.hpp"
#include "laws/drive.hpp"
#include "laws/terrain.hpp"
#include "plant/contact_state.hpp"
#include "plant/drive_counters.hpp"
#include "plant/dynamics.hpp"
#include "plant/energy_ledger.hpp"
#include "plant/loads.hpp"
#include "plant/mount.hpp"
#include "plant/set_points.hpp"

namespace hexapod {

constexpr double kLocatedTouchDepth = 2e-7;  // m; touch-downs that were located are less deep
constexpr double kStanding = 1e-12;  // m, height of a foot that stands on the ground but for rounding

template <class SystemT>
class Plant {
 public:
  using System = SystemT;
  static constexpr bool kPrescribed = System::kPrescribed;  // joints follow a given motion
  using Contact = ContactState<typename System::LegJacobian>;

  Plant(const Dynamics& body, std::vector<FootMount> mounts, ContactLaw law, Terrain terrain,
        DriveLaw drive);
  Plant(Plant&& other);
  ~Plant();

  // Everything below refers to the state of the last call. Dynamics do not depend on the base
  // position, so they are evaluated with the base at the origin: no precision is lost far from the origin.
  // `implicit_dt` is the step of a method that takes contact forces at its end, else 0.
  void evaluate(double t, const VectorXd& q, const VectorXd& v, double implicit_dt);

  // The stops' torques of the evaluated state again, its modes having changed.
  void find_stops(const VectorXd& q, const VectorXd& v) {
    for (int j = 0; j < joints(); ++j)
      stop[j] = modes_frozen ? drive.stops.on(j, mode[j].stop, q[7 + j], v[6 + j])
                             : drive.stops(j, q[7 + j], v[6 + j]);
  }

  // Saves what solving needs of the evaluated state while others are evaluated.
  void save_evaluation();
  void restore_evaluation() { swap_saved(); }

  // The contact forces again, for another step at whose end they are taken; q as in the last call.
  void set_implicit_dt(const VectorXd& q, double implicit_dt);

  // At an accepted state: contacts that have begun or ended change their memory. The touch speed is
  // that of the last state out of the ground, or of the first in it where that is a located touch-down and
  // nearer to the surface, or where the face was not there before.
  void update_memories();

  // Force of the law on a contact at the evaluated state, whatever step a method takes forces over, N: it
  // never pulls and is inside the friction cone.
  Vec3 law_force(const Contact& foot) const;

  // Normal force of an active contact at the evaluated state, were it not cut off at zero, N.
  double pressing_force(const Contact& foot) const;

  // Margin of the piece of the law that a bristle is in, N; without a normal force it slides.
  double piece_margin(const Contact& foot) const;

  // Pushes that act from time t on; drives that have failed by then lose their torque. Nothing changes
  // before `loads.next_change(t)`.
  void begin_loads(double t);
  // Power of the pushes at the evaluated state where it moves at v, W.
  template <class Velocity>
  double push_power(const Velocity& v) const { return pushes_.any() ? push_force_.dot(v) : 0.0; }

  const Eigen::MatrixXd& mass_upper() const { return dynamics.mass_upper(); }
  const VectorXd& bias() const { return dynamics.bias(); }  // C v + g, less the pushes
  int joints() const { return tree.nv - 6; }
  double rate(int joint) const { return v_[6 + joint]; }
  const Vec3& center_of_mass() const { return dynamics.center_of_mass(); }  // relative to the base origin

  double kinetic_energy(const VectorXd& v) const;

  Vec3 center(const Contact& foot) const { return base_ + foot.center; }  // of its sphere, m, world axes
  std::size_t foot_of(std::size_t contact) const { return contact / per_foot; }
  // joints that move a contact
  const std::vector<std::size_t>& columns(std::size_t i) const { return columns_[foot_of(i)]; }

  void add_jacobian_transposed(std::size_t i, const Vec3& f, VectorXd& out) const {
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
  void find_modes(const VectorXd& q, const VectorXd& v, const VectorXd& demand);

  // Joints at rest with dry friction under the given motor torques: those that the torques left to them
  // break loose, and v' in `out`. A complementarity problem, by block pivoting and then, where that goes
  // round in circles, by Murty's rule of the least index.
  void find_slipping(const VectorXd& v, const VectorXd& torque, VectorXd& out);

  // Joints whose rate has passed zero under dry friction are at rest; whether they stay so is found with
  // the next modes. True if there are any.
  bool stop_turned_back(VectorXd& v) const;

  // What acts on the joints (n) but motors, friction and inertial forces, under the contact forces
  // `force(i)`: gravity and velocity forces, pushes, contacts, stops, N m.
  template <class Force>
  void find_external(const Force& force, VectorXd& out) const {
    out = -bias().tail(joints());
    for (std::size_t i = 0; i < feet.size(); ++i) {
      if (!feet[i].active) continue;
      const Vec3 f = force(i);
      for (std::size_t k = 0; k < columns(i).size(); ++k)
        out[Tree::column(columns(i)[k]) - 6] += feet[i].jl.col(k).dot(f);
    }
    if constexpr (!kPrescribed)
      for (int j = 0; j < joints(); ++j) out[j] += stop[j].torque;
  }

  // The same under the forces at the evaluated state.
  void find_external(VectorXd& out) const {
    find_external([this](std::size_t i) { return feet[i].contact.force; }, out);
  }

  // A contact's leg Jacobian with what gears leave of an external torque on each of its joints.
  typename System::LegJacobian left_by_gears(std::size_t i, const VectorXd& shares) const {
    typename System::LegJacobian left = feet[i].jl;
    for (std::size_t k = 0; k < columns(i).size(); ++k)
      left.col(k) *= shares[Tree::column(columns(i)[k]) - 6];
    return left;
  }

  // A row of M times the accelerations (nv), N m.
  double inertial_torque(int joint, const VectorXd& acceleration) const;

  double stored_in_stops(const VectorXd& q) const;

  // Adds dt of every power at the evaluated state to the ledger.
  void accumulate(EnergyLedger& ledger, const VectorXd& v, const VectorXd& torque,
                  double dt) const;

  // v' at the evaluated state under the given motor torques. A stuck joint has none; what it must hold
  // is left in `holding`.
  void acceleration(const VectorXd& v, const VectorXd& torque, VectorXd& out);

  Dynamics dynamics;
  Tree tree;
  std::vector<FootMount> mounts;
  ContactLaw law;
  Terrain terrain;
  DriveLaw drive;
  bool dry;  // a joint that is driven has dry friction
  bool needs_external;  // some gear's friction depends on the external load
  Loads loads;
  System system;
  double located_depth = kLocatedTouchDepth;  // m; the same, of the method in use
  bool differentiates_separated = false;  // feet out of contact have velocities and Jacobians too
  std::size_t per_foot;    // contacts a foot can have at once
  std::vector<Contact> feet;  // contacts: those of foot f are f * per_foot ...
  std::vector<StopTorque> stop;  // of each joint, at the evaluated state
  std::vector<DriveMode> mode;   // of each joint, as last found
  bool modes_frozen = false;     // motors and stops stay in their modes beyond the modes' ends
  // Contacts keep pressing or are released, stuck or sliding, and on their patch, as they remember.
  bool pieces_frozen = false;
  VectorXd holding;              // torque that stuck joints must hold, N m
  VectorXd external;             // of `find_external` as last accelerated, where `needs_external`, N m
  std::vector<GearResponse> gear_slopes;  // of each joint's gear friction, as last accelerated
  DriveCounters drive_counters;
  Vec3 ground_velocity = Vec3::Zero();
  long evaluations = 0;

 private:
  // Moves contacts at the evaluated state to the piece of the law that holds there; feet in the air slide.
  void update_pieces();

  // Whether a separated contact slides from its first touch on, were that now: what its bristle would take
  // is not within the static cone of the force that contact begins with, which is mostly zero.
  bool would_slide(const Contact& foot) const;

  void place_foot(std::size_t f, double t, const VectorXd& q, const VectorXd& v, double implicit_dt);

  void find_force(Contact& foot, const Vec3& world, double implicit_dt);

  // What a joint at rest does, by what it must hold or by how it has been found to accelerate.
  FrictionMode friction_from_rest(int j, double acceleration, double motor) const;

  struct SavedEvaluation {
    Dynamics::Results dynamics;
    VectorXd push_force, v;
    Vec3 base = Vec3::Zero();
    std::vector<Contact> feet;
    std::vector<StopTorque> stop;
  };

  void swap_saved();

  static constexpr int kBlockPasses = 4;

  PushForce pushes_;
  VectorXd push_force_;
  VectorXd q_local_, v_;
  Vec3 base_ = Vec3::Zero();  // position of the evaluated state, m
  SavedEvaluation saved_;
  std::vector<std::vector<std::size_t>> columns_;
};

}  // namespace hexapod
