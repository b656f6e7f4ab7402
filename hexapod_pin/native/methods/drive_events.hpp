// Switches of the joints' drives within a step: a torque limit reached or left, a stop run into, left or
// released, a joint that dry friction stops or that breaks loose. Modes are frozen within a step; the
// step ends shortly after the first switch, where the law itself says what the modes are then. Those of
// the contacts (contact_events.hpp) are located along with them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "methods/chart_flow.hpp"
#include "methods/contact_events.hpp"
#include "methods/error_control.hpp"
#include "methods/switch_root.hpp"

namespace hexapod {

template <class PlantT>
class DriveEvents final : public InsideStep {
 public:
  DriveEvents(ChartFlow<PlantT>& flow, const ErrorNorm& norm)
      : flow_(flow), norm_(norm), contacts_(flow, norm), set_points_(flow.plant.joints()), next_(set_points_),
        start_(flow.plant.joints()), end_(start_), inside_(start_) {
    flow.inside = this;
    PlantT& plant = flow.plant;
    plant.modes_frozen = true;
    const DriveLaw& drive = plant.drive;
    const auto finite = [](const VectorXd& x) { return x.size() > 0 && x.minCoeff() < kNeverReached; };
    idle_ = PlantT::kPrescribed ||
            !(plant.dry || drive.stops.present() || finite(drive.cap) || finite(drive.line_torque) ||
              !plant.loads.lost.empty());
  }

  // Whether set-points jump or motors have a torque-speed line or dry friction. Steps then have to keep a
  // share of their usual tolerance: nothing damps the errors of joints at their limits, and robots that
  // are thrown about add them up to ten times those of walks (docs/results/promise.md).
  static bool hard(const PlantT& plant, const Reference& reference) {
    return !PlantT::kPrescribed && (reference.jumps() || plant.dry || plant.drive.has_lines());
  }

  // Finds the modes at a state where the plant is evaluated; set-points may have jumped there.
  void start(PlantT& plant, Reference& reference, double t, const VectorXd& q, const VectorXd& v) {
    contacts_.start();
    if (idle_) return;
    next_.take(reference, t);
    if (is_known(plant, q, v)) return;
    std::swap(set_points_, next_);
    plant.servo_demand(q, v, set_points_, start_.demand);
    plant.find_modes(q, v, start_.demand);
    start_.angle = q.tail(plant.joints());
    start_.rate = v.tail(plant.joints());
    start_.holding = plant.holding;
    changed_ = false;
    known_ = true;
    last_ = Crossing();
  }

  // A step from t, or another try of it, begins.
  void begin(double t) {
    begin_ = t;
    seen_inside_ = kNeverReached;
    contacts_.begin(t);
  }

  // Notices switches there and back again within a step.
  void passed(double t, const VectorXd& y) override {
    contacts_.passed(t, y);
    if (idle_ || seen_inside_ < kNeverReached) return;
    find_state(t, y, inside_);
    Crossing first;
    const PlantT& plant = flow_.plant;
    for (int j = 0; j < plant.joints(); ++j)
      if (mode_at(inside_, j) != plant.mode[j]) find_crossing(j, inside_, t - begin_, first);
    if (first.share < 1.0) seen_inside_ = first.share * (t - begin_);
  }

  // Share of the step h, which ended at y with the plant evaluated there, at which it should end for the
  // first switch to be just behind it; 1 where the step may end here.
  double share(double t, const VectorXd& y, double h) {
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

  // Velocity errors of joints at their torque limit are not damped by their servos, and those of joints
  // that slide under dry friction and of feet that slide on bristles move their switches: they weigh more.
  // Those that a stop leaves stay until the joint is at the next. `floor`, `hard`: the least weights of
  // velocities without and with such joints or feet, s.
  void weigh(const PlantT& plant, double floor, double hard, ErrorNorm& norm) const {
    norm.floor = nothing_damps(plant) || contacts_.any_sliding() || (!idle_ && any_hard(plant)) ? hard : floor;
    if (!idle_) norm.floor = std::max(norm.floor, stop_weight(plant));
  }

  // Largest change of a motor's torque in the step of the last call of `share`, as a share of its cap; 0
  // where no torque is limited.
  double torque_change(const PlantT& plant) const {
    const DriveLaw& drive = plant.drive;
    double most = 0.0;
    for (int j = 0; !idle_ && j < plant.joints(); ++j) {
      const double before = drive.motor_torque(j, start_.demand[j], start_.rate[j]);
      const double after = drive.motor_torque(j, end_.demand[j], end_.rate[j]);
      most = std::max(most, std::abs(after - before) / drive.cap[j]);
    }
    return most;
  }

  bool idle() const { return idle_ && contacts_.idle(); }  // nothing can switch
  // whether a mode or a contact's piece of the law has ended in the step of the last call
  bool changed() const { return changed_ || contacts_.changed(); }

  // Takes over the end of an accepted step of h. Joints that have turned back under dry friction are at
  // rest there; the plant is evaluated at the state, as before. True where modes have changed.
  bool accept(PlantT& plant, Reference& reference, double t, double h, const VectorXd& q, VectorXd& v) {
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

  // As `accept`, for a method that finds the modes anew before its next step.
  void count(PlantT& plant, double h) const {
    const auto switched = [](const DriveMode& mode) { return mode != DriveMode(); };
    if (plant.drive_counters.idle() &&
        std::none_of(plant.mode.begin(), plant.mode.end(), switched))
      return;
    for (int j = 0; j < plant.joints(); ++j)
      plant.drive_counters.add(j, plant.mode[j].limit, plant.mode[j].stop, h);
  }
  void move_on() {
    contacts_.move_on();
    std::swap(start_, end_);
    last_ = Crossing();
    known_ = !changed_;
  }

 private:
  static constexpr double kNeverReached = 1e300;
  // Share of the velocity tolerance that the wrong mode behind a switch may cost.
  static constexpr double kOvershootShare = 1e-3;
  static constexpr double kStopVelocityWeight = 1.0;  // s
  static constexpr double kLeastAim = 2e-3, kMostAim = 0.5;  // of what is left of the step behind a switch

  // Whether errors of the trunk's velocity stay: of a body without joints, and in flight.
  static bool nothing_damps(const PlantT& plant) {
    const auto touches = [](const auto& foot) { return foot.active; };
    return plant.joints() == 0 || std::none_of(plant.feet.begin(), plant.feet.end(), touches);
  }

  static bool any_hard(const PlantT& plant) {
    const auto hard = [](const DriveMode& mode) {
      return mode.limit != LimitMode::within || mode.friction == FrictionMode::forward ||
             mode.friction == FrictionMode::backward;
    };
    return std::any_of(plant.mode.begin(), plant.mode.end(), hard);
  }

  // By how much [rad] an error of 1 rad/s that a joint takes from its stop turns it until the drive has
  // damped it, at most kStopVelocityWeight, s; of the worst joint at a stop.
  static double stop_weight(const PlantT& plant) {
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

  // Whether the modes are those of this state already: the end of the last step, the set-points the same.
  // What stuck joints hold depends on more than the joints.
  bool is_known(const PlantT& plant, const VectorXd& q, const VectorXd& v) const {
    return known_ && !plant.dry && next_.q == set_points_.q && next_.v == set_points_.v &&
           next_.torque == set_points_.torque && q.tail(plant.joints()) == start_.angle &&
           v.tail(plant.joints()) == start_.rate;
  }

  struct JointStates {
    VectorXd angle, rate, demand, holding;
    explicit JointStates(int n) : angle(VectorXd::Zero(n)), rate(angle), demand(angle), holding(angle) {}
  };
  struct Crossing {
    double share = 1.0, value = 0.0, step = 0.0;
    int joint = -1, index = -1;
  };

  void find_state(double t, const VectorXd& y, JointStates& at) {
    set_points_.take(flow_.reference, t);
    for (int j = 0; j < flow_.plant.joints(); ++j) {
      at.angle[j] = flow_.joint_angle(y, j);
      at.rate[j] = flow_.v(y)[6 + j];
      at.demand[j] = flow_.plant.drive.demand(j, set_points_.q[j] - at.angle[j],
                                              set_points_.v[j] - at.rate[j], set_points_.torque[j]);
    }
  }

  void find_end(double t, const VectorXd& y) {
    find_state(t, y, end_);
    const PlantT& plant = flow_.plant;
    if (!plant.dry) return;
    const auto stuck = [](const DriveMode& mode) { return mode.stuck(); };
    if (!std::any_of(plant.mode.begin(), plant.mode.end(), stuck)) return;
    flow_.rate_here(t, y, rate_);
    end_.holding = plant.holding;
  }

  DriveMode mode_at(const JointStates& at, int j) const {
    return flow_.plant.drive.mode(j, at.angle[j], at.rate[j], at.demand[j]);
  }

  bool ends(const PlantT& plant, int j) const {
    const DriveMode& now = plant.mode[j];
    if (mode_at(end_, j) != now) return true;
    return now.stuck() && std::abs(end_.holding[j]) > plant.drive.friction[j];
  }

  std::array<double, DriveLaw::kSwitches> switches(const PlantT& plant, int j,
                                                   const JointStates& at) const {
    return plant.drive.switches(j, plant.mode[j], at.angle[j], at.rate[j], at.demand[j],
                                at.holding[j]);
  }

  // Of joint j between the start of the step and a state h later.
  void find_crossing(int j, const JointStates& end, double h, Crossing& first) const {
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

  // Where switch k of joint j, with these values at the start and the end of a step of h, is zero.
  double root_of(int j, int k, double before, double after, double h) const {
    const bool again = last_.joint == j && last_.index == k;
    return switch_root(before, after, h, again ? EarlierTry{last_.step, last_.value} : EarlierTry());
  }

  ChartFlow<PlantT>& flow_;
  ErrorNorm norm_;
  ContactEvents<PlantT> contacts_;
  SetPoints set_points_, next_;
  JointStates start_, end_;  // of the step
  JointStates inside_;       // where it passed through
  double begin_ = 0.0;       // of the step, s
  double seen_inside_ = kNeverReached;  // where a mode seems to end and to come back, s from the start
  VectorXd rate_;
  Crossing last_;
  bool idle_ = false;
  bool changed_ = false, known_ = false;
};

}  // namespace hexapod
