// Switches of the joints' drives within a step: a torque limit reached or left, a stop run into, left or
// released, a joint that dry friction stops or that breaks loose. Modes are frozen within a step; the
// step ends shortly after the first switch, where the law itself says what the modes are then. Those of
// the contacts (contact_events.hpp) are located along with them.
#pragma once

#include <array>
#include <vector>

#include "methods/chart_flow.hpp"
#include "methods/contact_events.hpp"
#include "methods/error_control.hpp"

namespace hexapod {

template <class PlantT>
class DriveEvents final : public InsideStep {
 public:
  DriveEvents(ChartFlow<PlantT>& flow, const ErrorNorm& norm);

  // Whether set-points jump or motors have a torque-speed line or dry friction. Steps then have to keep a
  // share of their usual tolerance: nothing damps the errors of joints at their limits, and robots that
  // are thrown about add them up to ten times those of walks (docs/results/promise.md).
  static bool hard(const PlantT& plant, const Reference& reference);

  // Finds the modes at a state where the plant is evaluated; set-points may have jumped there.
  void start(PlantT& plant, Reference& reference, double t, const VectorXd& q, const VectorXd& v);

  // A step from t, or another try of it, begins.
  void begin(double t);

  // Notices switches there and back again within a step.
  void passed(double t, const VectorXd& y) override;

  // Share of the step h, which ended at y with the plant evaluated there, at which it should end for the
  // first switch to be just behind it; 1 where the step may end here.
  double share(double t, const VectorXd& y, double h);

  // Velocity errors of joints at their torque limit are not damped by their servos, and those of joints
  // that slide under dry friction and of feet that slide on bristles move their switches: they weigh more.
  // Those that a stop leaves stay until the joint is at the next. `floor`, `hard`: the least weights of
  // velocities without and with such joints or feet, s.
  void weigh(const PlantT& plant, double floor, double hard, ErrorNorm& norm) const;

  // Largest change of a motor's torque in the step of the last call of `share`, as a share of its cap; 0
  // where no torque is limited.
  double torque_change(const PlantT& plant) const;

  bool idle() const { return idle_ && contacts_.idle(); }  // nothing can switch
  // whether a mode or a contact's piece of the law has ended in the step of the last call
  bool changed() const { return changed_ || contacts_.changed(); }

  // Takes over the end of an accepted step of h. Joints that have turned back under dry friction are at
  // rest there; the plant is evaluated at the state, as before. True where modes have changed.
  bool accept(PlantT& plant, Reference& reference, double t, double h, const VectorXd& q, VectorXd& v);

  // As `accept`, for a method that finds the modes anew before its next step.
  void count(PlantT& plant, double h) const;
  void move_on();

 private:
  static constexpr double kNeverReached = 1e300;
  // Share of the velocity tolerance that the wrong mode behind a switch may cost.
  static constexpr double kOvershootShare = 1e-3;
  static constexpr double kStopVelocityWeight = 1.0;  // s
  static constexpr double kLeastAim = 2e-3, kMostAim = 0.5;  // of what is left of the step behind a switch

  // Whether errors of the trunk's velocity stay: of a body without joints, and in flight.
  static bool nothing_damps(const PlantT& plant);

  static bool any_hard(const PlantT& plant);

  // By how much [rad] an error of 1 rad/s that a joint takes from its stop turns it until the drive has
  // damped it, at most kStopVelocityWeight, s; of the worst joint at a stop.
  static double stop_weight(const PlantT& plant);

  // Whether the modes are those of this state already: the end of the last step, the set-points the same.
  // What stuck joints hold depends on more than the joints.
  bool is_known(const PlantT& plant, const VectorXd& q, const VectorXd& v) const;

  struct JointStates {
    VectorXd angle, rate, demand, holding, external;
    explicit JointStates(int n)
        : angle(VectorXd::Zero(n)), rate(angle), demand(angle), holding(angle), external(angle) {}
  };
  struct Crossing {
    double share = 1.0, value = 0.0, step = 0.0;
    int joint = -1, index = -1;
  };

  void find_state(double t, const VectorXd& y, JointStates& at);

  void find_end(double t, const VectorXd& y);

  DriveMode mode_at(const JointStates& at, int j) const;

  bool ends(const PlantT& plant, int j) const;

  std::array<double, DriveLaw::kSwitches> switches(const PlantT& plant, int j,
                                                   const JointStates& at) const;

  // Of joint j between the start of the step and a state h later.
  void find_crossing(int j, const JointStates& end, double h, Crossing& first) const;

  // Where switch k of joint j, with these values at the start and the end of a step of h, is zero.
  double root_of(int j, int k, double before, double after, double h) const;

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
