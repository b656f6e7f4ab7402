#include "run/sampled_rollout.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "plant/arrow.hpp"
#include "plant/dense.hpp"
#include "plant/prescribed_system.hpp"
#include "plant/reaction.hpp"

namespace hexapod {

template <class PlantT>
void SampledRollout<PlantT>::command(const DriveCommand& c) {
  torque_time_ = kNever;
  reference_.where_to_begin(time_, set_points_.q, set_points_.v);
  const bool smooth = std::isfinite(c.arrival), rated = c.rate.size() > 0;
  double arrival = std::max(c.arrival, time_);
  for (Eigen::Index j = 0; j < rate_limit_.size(); ++j) {
    const double way = c.position[j] - set_points_.q[j], limit = rate_limit_[j];
    const double time = !smooth ? std::abs(way) / limit
                                : shortest_cubic(way, set_points_.v[j], rated ? &c.rate[j] : nullptr, limit);
    arrival = std::max(arrival, time_ + time);
  }
  const VectorXd zero = VectorXd::Zero(set_points_.q.size());
  const VectorXd& torque = c.torque.size() > 0 ? c.torque : zero;
  if (!smooth || !(arrival > time_)) {
    reference_.command(time_, arrival, c.position, rated ? c.rate : zero, torque);
  } else {
    const VectorXd mean = (c.position - set_points_.q) / (arrival - time_);
    reference_.command_smoothly(time_, arrival, c.position, rated ? c.rate : mean, torque);
  }
  reference_.begin_step(time_);
}

template <class PlantT>
VectorXd SampledRollout<PlantT>::set_points() {
  reference_.begin_step(time_);
  set_points_.take(reference_, time_);
  return set_points_.q;
}

template <class PlantT>
void SampledRollout<PlantT>::read(Reading& out) {
  find_torque(time_, q_, v_);
  out.time = time_;
  out.q = q_.tail(plant_.joints());
  out.v = v_.tail(plant_.joints());
  out.torque = torque_;
  out.rotation = plant_.dynamics.base_rotation();
  out.angular_velocity = v_.template segment<3>(3);
  if constexpr (!PlantT::kPrescribed) plant_.acceleration(v_, torque_, acceleration_);
  out.acceleration = acceleration_.template head<3>() +
                     v_.template segment<3>(3).cross(v_.template head<3>()) -
                     out.rotation.transpose() * plant_.dynamics.gravity();
  const std::size_t mounts = plant_.mounts.size();
  out.foot_force.setZero(Eigen::Index(mounts), 3);
  out.loaded.assign(mounts, false);
  for (std::size_t i = 0; i < plant_.feet.size(); ++i) {
    if (!plant_.feet[i].active) continue;
    const Vec3& force = plant_.feet[i].contact.force;
    out.foot_force.row(Eigen::Index(plant_.foot_of(i))) += force.transpose();
    out.loaded[plant_.foot_of(i)] |= plant_.feet[i].ground.normal.dot(force) > 0.0;
  }
}

template <class PlantT>
SampledRollout<PlantT>::SampledRollout(PlantT plant, const RunSetup& setup, bool differentiates_separated)
    : plant_(std::move(plant)), reference_(setup.reference), q_(setup.start.q), v_(setup.start.v),
      ledger_(plant_.feet.size()), time_(setup.start.time), start_(setup.start.time),
      interval_(setup.sample), end_(setup.end), sample_index_(setup.start.first), heat_(setup.motors),
      recorder_(plant_, setup.omitted, setup.estimates, heat_.any()), trunk_(setup.trunk), summary_(plant_.joints(), plant_.mounts.size()),
      displaced_summary_(summary_), other_summary_(summary_), foot_loads_(plant_.mounts.size()),
      record_(setup.record), estimates_(setup.estimates), keeps_forces_(record_ && keeps_forces(setup)),
      rate_limit_(setup.rate_limit), torque_limit_(setup.torque_limit), limit_now_(setup.torque_limit),
      has_lines_(torque_limit_.size() > 0 && plant_.drive.has_lines()), set_points_(plant_.joints()),
      torque_(plant_.joints()) {
  plant_.differentiates_separated = differentiates_separated;
  if constexpr (PlantT::kPrescribed) reference_.prescribe();
  restore_memories(setup.start.contacts);
  begin_loads();
  reference_.begin_step(time_);
  reference_.restore(setup.start.command, time_);
  for (RunSummary* summary : {&summary_, &displaced_summary_, &other_summary_}) {
    summary->set_window(setup.window.begin, setup.window.end, setup.window.cycle);
    if (torque_limit_.size() > 0) summary->set_limit(torque_limit_);
  }
  if (setup.record) summary_.keep_peaks(plant_.tree.nq + plant_.tree.nv);
  monitor_.start(setup.limits, time_);
}

template <class PlantT>
SampledRollout<PlantT>::~SampledRollout() = default;

template <class PlantT>
void SampledRollout<PlantT>::record_start(const Checkpoint& start) {
  if (estimates_) {
    displaced_step(time_, q_, v_);
    displaced_sample(time_, q_, v_, 0.0);
  }
  see(time_, q_, v_);
  record(0.0);
  for (Eigen::Index i = 0; i < start.impulse.rows(); ++i)
    ledger_.impulse[std::size_t(i)] = start.impulse.row(i).transpose();
}

template <class PlantT>
double SampledRollout<PlantT>::next_stop(double until) const {
  const double jump = horizon(until), sample = next_sample();
  return jump > sample || same_time(jump, sample) ? sample : jump;
}

template <class PlantT>
double SampledRollout<PlantT>::horizon(double until) const {
  const double jump =
      std::min({until, reference_.next_jump(time_), plant_.loads.next_change(time_)});
  const double sample = std::round(jump / interval_) * interval_;
  return same_time(jump, sample) ? sample : jump;
}

template <class PlantT>
void SampledRollout<PlantT>::arrive_at_sample(double t) {
  time_ = t;
  ++sample_index_;
  record(interval_);
}

template <class PlantT>
void SampledRollout<PlantT>::begin_loads() {
  plant_.begin_loads(time_);
  torque_time_ = kNever;
}

// After every step: what it calls here is small.
template <class PlantT>
[[gnu::flatten]] bool SampledRollout<PlantT>::accepted(double t, const VectorXd& q, const VectorXd& v) {
  see(t, q, v);
  return monitor_.goes_on(t, plant_.evaluations);
}

template <class PlantT>
bool SampledRollout<PlantT>::looks_at_step(double t) {
  skipped_ = !skipped_ && !displaced_summary_.ends_at(t);
  return !skipped_;
}

template <class PlantT>
void SampledRollout<PlantT>::displaced_step(double t, const VectorXd& q, const VectorXd& v) {
  summarise(displaced_summary_, t, q, v);
}

template <class PlantT>
void SampledRollout<PlantT>::displaced_sample(double t, const VectorXd& q, const VectorXd& v,
                                              double force_error) {
  if (!record_) return;
  torque_time_ = kNever;
  find_torque(t, q, v);
  displaced_q_ = q, force_error_ = force_error;
  displaced_torque_ = torque_;
  torque_time_ = kNever;
}

template <class PlantT>
Checkpoint SampledRollout<PlantT>::checkpoint_now(std::vector<double> controller) const {
  Checkpoint c;
  c.first = sample_index_, c.time = time_, c.q = q_, c.v = v_;
  c.contacts = contact_memories();
  c.controller = std::move(controller);
  c.command = reference_.pending();
  c.impulse.resize(Eigen::Index(ledger_.impulse.size()), 3);
  for (std::size_t i = 0; i < ledger_.impulse.size(); ++i)
    c.impulse.row(Eigen::Index(i)) = ledger_.impulse[i].transpose();
  return c;
}

template <class PlantT>
long SampledRollout<PlantT>::loaded_foot() const {
  long most = -1;
  double largest = 0.0;
  for (std::size_t i = 0; i < plant_.feet.size(); ++i) {
    const double force = plant_.feet[i].active ? plant_.feet[i].contact.force.norm() : 0.0;
    if (force > largest) largest = force, most = long(plant_.foot_of(i));
  }
  return most;
}

template <class PlantT>
inline bool SampledRollout<PlantT>::keeps_forces(const RunSetup& setup) {
  return std::find(setup.omitted.begin(), setup.omitted.end(), "foot_force") == setup.omitted.end();
}

template <class PlantT>
inline void SampledRollout<PlantT>::find_torque(double t, const VectorXd& q, const VectorXd& v) {
  const bool own = &q == &q_;
  if (own && t == torque_time_) return;
  torque_time_ = own ? t : kNever;
  reference_.begin_sample(t);
  if constexpr (PlantT::kPrescribed) {
    set_points_.take_motion(reference_, t);
    prescribed_acceleration(plant_, set_points_.a, acceleration_);
    reaction_torque(plant_, v, acceleration_, torque_);
  } else {
    set_points_.take(reference_, t);
    plant_.servo_torque(q, v, set_points_, torque_);
  }
}

template <class PlantT>
inline void SampledRollout<PlantT>::find_limits(RunSummary& summary, const VectorXd& v) {
  const DriveLaw& drive = plant_.drive;
  for (int j = 0; j < plant_.joints(); ++j) {
    const double rate = v[6 + j];
    const double line = torque_[j] < 0.0 ? -drive.lower_line(j, rate) : drive.upper_line(j, rate);
    limit_now_[j] = std::min(torque_limit_[j], kLimitShare * line);
  }
  summary.set_limit(limit_now_);
}

template <class PlantT>
inline void SampledRollout<PlantT>::see(double t, const VectorXd& q, const VectorXd& v) {
  trunk_.look(plant_.terrain, plant_.dynamics.base_rotation(), q.template head<3>(), v, t);
  summarise(summary_, t, q, v);
  if (heat_.any()) heat_.see(t, torque_);
  if (estimates_ && (skipped_ || other_summary_.ends_at(t) || t == start_))
    repeat(other_summary_, t, q, v);
}

template <class PlantT>
inline void SampledRollout<PlantT>::repeat(RunSummary& summary, double t, const VectorXd& q,
                                           const VectorXd& v) {
  if (has_lines_) summary.set_limit(limit_now_);
  summary.record(t, q, v, torque_, foot_loads_, q.template head<3>() + plant_.center_of_mass());
}

template <class PlantT>
inline void SampledRollout<PlantT>::summarise(RunSummary& summary, double t, const VectorXd& q,
                                              const VectorXd& v) {
  find_torque(t, q, v);
  if (has_lines_) find_limits(summary, v);
  read_feet(plant_, foot_loads_);
  summary.record(t, q, v, torque_, foot_loads_, q.template head<3>() + plant_.center_of_mass());
}

template <class PlantT>
inline SampleError SampledRollout<PlantT>::sample_error() const {
  using Attitude = Eigen::Map<const Eigen::Quaterniond>;
  const auto largest = [](const VectorXd& x) { return x.size() > 0 ? x.cwiseAbs().maxCoeff() : 0.0; };
  const Vec3 turn = (Attitude(q_.data() + 3).conjugate() * Attitude(displaced_q_.data() + 3)).vec();
  SampleError error;
  error << (q_ - displaced_q_).template head<3>().norm(), 2.0 * turn.norm(),
      largest((q_ - displaced_q_).tail(plant_.joints())), largest(torque_ - displaced_torque_),
      force_error_;
  return error;
}

template <class PlantT>
inline void SampledRollout<PlantT>::record(double interval) {
  find_torque(time_, q_, v_);
  if (heat_.any()) heat_.see(time_, torque_);
  if (record_)
    recorder_.sample(plant_, time_, q_, v_, torque_, set_points_.q, set_points_.v, ledger_,
                     interval, estimates_ ? sample_error() : SampleError::Zero().eval(), heat_);
  for (Vec3& impulse : ledger_.impulse) impulse.setZero();
}

template <class PlantT>
inline RowMatrix SampledRollout<PlantT>::contact_memories() const {
  RowMatrix rows(plant_.feet.size(), kMemoryColumns);
  for (std::size_t i = 0; i < plant_.feet.size(); ++i) {
    const ContactMemory& m = plant_.feet[i].memory;
    rows.row(i) << m.touch_speed, m.stretch.x(), m.stretch.y(), m.stretch.z(),
        double(m.touching), double(m.sliding), m.face.x(), m.face.y(), m.face.z(), m.face_gap,
        double(m.patch), double(m.left);
  }
  return rows;
}

template <class PlantT>
inline void SampledRollout<PlantT>::restore_memories(const RowMatrix& rows) {
  for (std::size_t i = 0; i < std::size_t(rows.rows()); ++i) {
    ContactMemory& m = plant_.feet[i].memory;
    m = {rows(i, 0), rows.row(i).segment<3>(1).transpose(), rows(i, 4) != 0.0, rows(i, 5) != 0.0};
    if (rows.cols() < kMemoryColumns) continue;
    m.face = rows.row(i).segment<3>(6).transpose();
    m.face_gap = rows(i, 9);
    m.patch = int(rows(i, 10)), m.left = int(rows(i, 11));
  }
}

template class SampledRollout<Plant<ArrowSystem>>;
template class SampledRollout<Plant<DenseSystem>>;
template class SampledRollout<Plant<PrescribedSystem>>;

}  // namespace hexapod
