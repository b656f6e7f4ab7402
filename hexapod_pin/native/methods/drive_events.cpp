#include "methods/drive_events.hpp"

#include <algorithm>
#include <cmath>

#include "methods/switch_root.hpp"
#include "plant/arrow.hpp"
#include "plant/dense.hpp"
#include "plant/prescribed_system.hpp"

namespace hexapod {

template <class PlantT>
DriveEvents<PlantT>::DriveEvents(ChartFlow<PlantT>& flow, const ErrorNorm& norm)
    : flow_(flow), norm_(norm), contacts_(flow, norm), set_points_(flow.plant.joints()),
      next_(set_points_), start_(flow.plant.joints()), end_(start_), inside_(start_) {
  flow.inside = this;
  PlantT& plant = flow.plant;
  plant.modes_frozen = true;
  const DriveLaw& drive = plant.drive;
  const auto finite = [](const VectorXd& x) { return x.size() > 0 && x.minCoeff() < kNeverReached; };
  idle_ = PlantT::kPrescribed ||
          !(plant.dry || drive.stops.present() || finite(drive.cap) || finite(drive.line_torque) ||
            !plant.loads.lost.empty());
}

template <class PlantT>
bool DriveEvents<PlantT>::hard(const PlantT& plant, const Reference& reference) {
  return !PlantT::kPrescribed && (reference.jumps() || plant.dry || plant.drive.has_lines());
}

template <class PlantT>
void DriveEvents<PlantT>::start(PlantT& plant, Reference& reference, double t, const VectorXd& q,
                                const VectorXd& v) {
  contacts_.start();
  if (idle_) return;
  next_.take(reference, t);
  if (is_known(plant, q, v)) return;
  std::swap(set_points_, next_);
  plant.servo_demand(q, v, set_points_, start_.demand);
  plant.find_modes(q, v, start_.demand);
  start_.angle = q.tail(plant.joints());
  start_.rate = v.tail(plant.joints());
  start_.holding = plant.holding, start_.external = plant.external;
  changed_ = false;
  known_ = true;
  last_ = Crossing();
}

template <class PlantT>
void DriveEvents<PlantT>::begin(double t) {
  begin_ = t;
  seen_inside_ = kNeverReached;
  contacts_.begin(t);
}

template <class PlantT>
void DriveEvents<PlantT>::passed(double t, const VectorXd& y) {
  contacts_.passed(t, y);
  if (idle_ || seen_inside_ < kNeverReached) return;
  find_state(t, y, inside_);
  Crossing first;
  const PlantT& plant = flow_.plant;
  for (int j = 0; j < plant.joints(); ++j)
    if (mode_at(inside_, j) != plant.mode[j]) find_crossing(j, inside_, t - begin_, first);
  if (first.share < 1.0) seen_inside_ = first.share * (t - begin_);
}

template <class PlantT>
double DriveEvents<PlantT>::share(double t, const VectorXd& y, double h) {
  const double contact = contacts_.share(t, y, h);
  if (idle_) return contact;
  const PlantT& plant = flow_.plant;
  find_end(t, y);
  changed_ = false;
  Crossing first;
  for (int j = 0; j < plant.joints(); ++j) {
    if (!ends(plant, j)) continue;
    changed_ = true;
    find_crossing(j, end_, h, first);
  }
  first.step = h;
  last_ = first;
  return std::min(contact, first.share < 1.0 ? first.share : std::min(1.0, seen_inside_ / h));
}

template <class PlantT>
void DriveEvents<PlantT>::weigh(const PlantT& plant, double floor, double hard, ErrorNorm& norm) const {
  norm.floor = nothing_damps(plant) || contacts_.any_sliding() || (!idle_ && any_hard(plant)) ? hard : floor;
  if (!idle_) norm.floor = std::max(norm.floor, stop_weight(plant));
}

template <class PlantT>
double DriveEvents<PlantT>::torque_change(const PlantT& plant) const {
  const DriveLaw& drive = plant.drive;
  double most = 0.0;
  for (int j = 0; !idle_ && j < plant.joints(); ++j) {
    const double before = drive.motor_torque(j, start_.demand[j], start_.rate[j]);
    const double after = drive.motor_torque(j, end_.demand[j], end_.rate[j]);
    most = std::max(most, std::abs(after - before) / drive.cap[j]);
  }
  return most;
}

template <class PlantT>
bool DriveEvents<PlantT>::accept(PlantT& plant, Reference& reference, double t, double h, const VectorXd& q,
                                 VectorXd& v) {
  count(plant, h);
  if (idle_ || !changed_) {
    if (!idle_) move_on();
    contacts_.start();
    return contacts_.changed();
  }
  known_ = false;
  if (plant.stop_turned_back(v)) plant.evaluate(t, q, v, 0.0);
  start(plant, reference, t, q, v);
  return true;
}

template <class PlantT>
void DriveEvents<PlantT>::count(PlantT& plant, double h) const {
  const auto switched = [](const DriveMode& mode) { return mode != DriveMode(); };
  if (plant.drive_counters.idle() &&
      std::none_of(plant.mode.begin(), plant.mode.end(), switched))
    return;
  for (int j = 0; j < plant.joints(); ++j)
    plant.drive_counters.add(j, plant.mode[j].limit, plant.mode[j].stop, h);
}

template <class PlantT>
void DriveEvents<PlantT>::move_on() {
  contacts_.move_on();
  std::swap(start_, end_);
  last_ = Crossing();
  known_ = !changed_;
}

template <class PlantT>
inline bool DriveEvents<PlantT>::nothing_damps(const PlantT& plant) {
  const auto touches = [](const auto& foot) { return foot.active; };
  return plant.joints() == 0 || std::none_of(plant.feet.begin(), plant.feet.end(), touches);
}

template <class PlantT>
inline bool DriveEvents<PlantT>::any_hard(const PlantT& plant) {
  const auto hard = [](const DriveMode& mode) {
    return mode.limit != LimitMode::within || mode.friction == FrictionMode::forward ||
           mode.friction == FrictionMode::backward;
  };
  return std::any_of(plant.mode.begin(), plant.mode.end(), hard);
}

template <class PlantT>
inline double DriveEvents<PlantT>::stop_weight(const PlantT& plant) {
  double most = 0.0;
  for (int j = 0; j < plant.joints(); ++j) {
    const DriveMode& mode = plant.mode[j];
    if (mode.stop != StopMode::upper && mode.stop != StopMode::lower) continue;
    const double damping = plant.drive.damping[j] + plant.drive.damping_on(j, mode.limit);
    const double inertia = plant.mass_upper()(6 + j, 6 + j);
    most = std::max(most, inertia < kStopVelocityWeight * damping ? inertia / damping : kStopVelocityWeight);
  }
  return most;
}

template <class PlantT>
inline bool DriveEvents<PlantT>::is_known(const PlantT& plant, const VectorXd& q, const VectorXd& v) const {
  return known_ && !plant.dry && next_.q == set_points_.q && next_.v == set_points_.v &&
         next_.torque == set_points_.torque && q.tail(plant.joints()) == start_.angle &&
         v.tail(plant.joints()) == start_.rate;
}

template <class PlantT>
inline void DriveEvents<PlantT>::find_state(double t, const VectorXd& y, JointStates& at) {
  set_points_.take(flow_.reference, t);
  for (int j = 0; j < flow_.plant.joints(); ++j) {
    at.angle[j] = flow_.joint_angle(y, j);
    at.rate[j] = flow_.v(y)[6 + j];
    at.demand[j] = flow_.plant.drive.demand(j, set_points_.q[j] - at.angle[j],
                                            set_points_.v[j] - at.rate[j], set_points_.torque[j]);
  }
}

template <class PlantT>
inline void DriveEvents<PlantT>::find_end(double t, const VectorXd& y) {
  find_state(t, y, end_);
  const PlantT& plant = flow_.plant;
  if (!plant.dry) return;
  const auto stuck = [](const DriveMode& mode) { return mode.stuck(); };
  if (!std::any_of(plant.mode.begin(), plant.mode.end(), stuck)) return;
  flow_.rate_here(t, y, rate_);
  end_.holding = plant.holding, end_.external = plant.external;
}

template <class PlantT>
inline DriveMode DriveEvents<PlantT>::mode_at(const JointStates& at, int j) const {
  return flow_.plant.drive.mode(j, at.angle[j], at.rate[j], at.demand[j]);
}

template <class PlantT>
inline bool DriveEvents<PlantT>::ends(const PlantT& plant, int j) const {
  const DriveMode& now = plant.mode[j];
  if (mode_at(end_, j) != now) return true;
  if (!now.stuck()) return false;
  const double motor = plant.drive.torque_on(j, now.limit, end_.demand[j], end_.rate[j]);
  return std::abs(end_.holding[j]) > plant.drive.holding_limit(j, motor, end_.holding[j], end_.external[j]);
}

template <class PlantT>
inline std::array<double, DriveLaw::kSwitches> DriveEvents<PlantT>::switches(
    const PlantT& plant, int j, const JointStates& at) const {
  return plant.drive.switches(j, plant.mode[j], at.angle[j], at.rate[j], at.demand[j],
                              at.holding[j], at.external[j]);
}

template <class PlantT>
inline void DriveEvents<PlantT>::find_crossing(int j, const JointStates& end, double h, Crossing& first) const {
  const PlantT& plant = flow_.plant;
  const auto before = switches(plant, j, start_), after = switches(plant, j, end);
  const double most = kOvershootShare * norm_.tolerance / norm_.weight(h);
  for (int k = 0; k < DriveLaw::kSwitches; ++k) {
    if (!(after[k] < 0.0)) continue;
    const double root = root_of(j, k, before[k], after[k], h), rest = 1.0 - root;
    const bool sliding = k == DriveLaw::kSwitches - 1 && !plant.mode[j].stuck();
    double excess = -after[k];  // rad/s
    if (!sliding) excess *= 0.5 * rest * h / plant.mass_upper()(6 + j, 6 + j);
    if (!(excess > most)) continue;
    const double reduction = sliding ? most / excess : std::sqrt(most / excess);
    const double share = root + std::clamp(0.5 * reduction, kLeastAim, kMostAim) * rest;
    if (share < first.share) first = {share, after[k], h, j, k};
  }
}

template <class PlantT>
inline double DriveEvents<PlantT>::root_of(int j, int k, double before, double after, double h) const {
  const bool again = last_.joint == j && last_.index == k;
  return switch_root(before, after, h, again ? EarlierTry{last_.step, last_.value} : EarlierTry());
}

template class DriveEvents<Plant<ArrowSystem>>;
template class DriveEvents<Plant<DenseSystem>>;
template class DriveEvents<Plant<PrescribedSystem>>;

}  // namespace hexapod
