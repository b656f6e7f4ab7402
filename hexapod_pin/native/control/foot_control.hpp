// Foot control after S1: the planned feet, moved by what they feel. One row is one robot; a row's answer
// depends on that row alone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "control/control_memory.hpp"
#include "control/leg_chain.hpp"
#include "control/stance_forces.hpp"
#include "control/walk_table.hpp"

namespace hexapod {

enum class ForceSource { foot, torque, current };
enum class SlipSignal { none, force, slip };

struct FootControlSettings {
  double period = 0.005;     // s
  double lead = 0.005;       // from a tick until its command has arrived, s
  ForceSource source = ForceSource::foot;
  double filter_time = 0.0;  // of the forces, s
  double threshold = 1.0;    // force of a foot that touches, N
  SlipSignal signal = SlipSignal::none;
  SlipGains slip;
  bool suspended = false;
  SuspensionGains suspension;
  double nominal_load = 0.0;  // of a standing foot, N; 0: the split of `weight`
  double weight = 0.0;        // N
  Vec3 centre = Vec3::Zero(); // of mass, trunk frame, standing, m
  bool anticipates = false;   // whether commands allow for how servos give way to the nominal loads
  std::array<Vec3, kLegs> give = {};  // of the servos, 1 / kp, rad/(N m)
  double load_time = 0.05;    // in which a foot takes up its share, and gives it back, s
  TouchDownSettings touch_down;
  double follow_height = 0.0, follow_tilt = 0.0;  // rates at which the trunk follows the ground, 1/s
  double level_rate = 0.0;                        // of levelling, 1/s
  double level_limit = 0.0;                       // tilt of the feet's plane to level the trunk, rad
};

// What a robot reads, one row.
struct Readings {
  const double *q, *v, *torque, *rotation, *rate, *acceleration, *foot_force;
};

class FootControlLaw {
 public:
  FootControlLaw(const FootControlSettings& settings, std::vector<LegChain> legs,
                 std::vector<std::array<std::size_t, 3>> joints, std::vector<std::size_t> feet)
      : set_(settings), reflex_(settings.touch_down, settings.period), legs_(std::move(legs)),
        joints_(std::move(joints)), feet_(std::move(feet)) {}

  // Whether rows of so many joints and feet hold those of the legs.
  bool fits(std::size_t joints, std::size_t feet) const {
    bool good = legs_.size() == kLegs && joints_.size() == kLegs && feet_.size() == kLegs;
    for (const auto& leg : joints_)
      for (const std::size_t j : leg) good = good && j < joints;
    for (const std::size_t f : feet_) good = good && f < feet;
    return good;
  }

  // Targets of the feet [m] at the end of the tick's command, and the memory after it.
  void update(const WalkTable& table, double time, const Readings& in, ControlMemory& m, LegVectors& out) const {
    const double now = time + set_.lead - m.lag;
    const WalkPlan plan = slowed(table.at(now), m.pace);
    Felt felt;
    sense(in, m, felt);
    level(felt, m);
    for (int l = 0; l < kLegs; ++l) {
      LegMemory& leg = m.leg[l];
      const bool stood = leg.phase.on_ground();
      const FootTouch touch{leg.force, felt.touches[l],
                            leg.force.norm() < kFreeShare * set_.threshold, felt.up};
      const Vec3 p = plan[l].foot + leg.phase.offset;
      if (stood && !plan[l].down && leg.phase.mode == LegMode::down) leave(leg);
      reflex_.step(plan[l], touch, m.pace * table.ground_velocity(now, p), leg.phase);
    }
    keep_time(plan, m);
    follow_ground(plan, m);
    share_load(plan, m);
    if (set_.signal != SlipSignal::none) correct(felt, m);
    if (set_.suspended) suspend(plan, felt, m);
    const LegNumbers load = nominal_loads(plan, felt, m, &LegMemory::share);
    for (int l = 0; l < kLegs; ++l) {
      const LegMemory& leg = m.leg[l];
      out[l] = plan[l].foot + leg.phase.offset + leg.correction + leg.suspension.travel * felt.up;
      out[l].z() += m.pitch * plan[l].foot.x() + m.roll * plan[l].foot.y();
      if (set_.anticipates) out[l] -= felt.give[l] * (load[l] * felt.up);
    }
    m.begun = 1.0;
  }

 private:
  static constexpr double kFreeShare = 0.25;  // of the threshold: less than that is no contact, -
  static constexpr double kPaceTime = 0.02;  // in which the plan's clock stops or starts, s

  struct Felt {
    Vec3 down = -Vec3::UnitZ();  // direction of gravity, trunk axes
    Vec3 up = Vec3::UnitZ();     // normal of the plane of the standing feet, trunk axes
    Vec3 rate;                   // of the trunk, rad/s
    double roll = 0.0, pitch = 0.0;
    LegVectors foot, moved;      // measured places, and their change since the last tick, m
    std::array<bool, kLegs> touches;
    std::array<Mat3, kLegs> give;  // of a foot to the force on it: J diag(1/kp) J^T, m/N
  };

  static Vec3 vector(const double* at) { return {at[0], at[1], at[2]}; }

  Vec3 of_leg(const double* row, int l) const {
    return {row[joints_[l][0]], row[joints_[l][1]], row[joints_[l][2]]};
  }

  // Places of the feet and forces on them; the trunk's attitude.
  void sense(const Readings& in, ControlMemory& m, Felt& felt) const {
    const Mat3 rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(in.rotation);
    felt.down = -rotation.row(2).transpose();
    felt.roll = std::atan2(rotation(2, 1), rotation(2, 2));
    felt.pitch = std::asin(std::clamp(-rotation(2, 0), -1.0, 1.0));
    felt.rate = vector(in.rate);
    const TrunkMotion trunk{felt.rate, vector(in.acceleration)};
    const double keep = set_.filter_time / (set_.filter_time + set_.period);
    LegNumbers standing;
    for (int l = 0; l < kLegs; ++l) {
      LegMemory& leg = m.leg[l];
      const Vec3 v = of_leg(in.v, l);
      const LegPose pose = legs_[l].pose(of_leg(in.q, l));
      felt.foot[l] = pose.foot;
      felt.give[l] = pose.jacobian * set_.give[l].asDiagonal() * pose.jacobian.transpose();
      felt.moved[l] = m.begun > 0.0 ? Vec3(pose.foot - leg.foot) : Vec3::Zero();
      leg.foot = pose.foot;
      const Vec3 force = set_.source == ForceSource::foot
                             ? Vec3(rotation.transpose() * vector(in.foot_force + 3 * feet_[l]))
                             : estimated(l, in, pose, trunk, v, leg, m.begun > 0.0);
      leg.rates = v;
      leg.force = m.begun > 0.0 ? Vec3(keep * leg.force + (1.0 - keep) * force) : force;
      felt.touches[l] = leg.force.norm() > set_.threshold;
      standing[l] = leg.phase.on_ground() ? 1.0 : 0.0;
    }
    const Vec3 plane = fitted_plane(felt.foot, standing);
    felt.up = Vec3(-plane[1], -plane[2], 1.0).normalized();
  }

  // Force on a foot from the torques of its joints: J^-T (own torque - torque).
  Vec3 estimated(int l, const Readings& in, const LegPose& pose, const TrunkMotion& trunk, const Vec3& v,
                 const LegMemory& leg, bool begun) const {
    const Vec3 a = begun ? Vec3((v - leg.rates) / set_.period) : Vec3::Zero();
    Vec3 torque = of_leg(in.torque, l);
    if (set_.source == ForceSource::torque) torque -= legs_[l].friction(v);
    return pose.jacobian.transpose().inverse() * (legs_[l].own_torque(pose, trunk, v, a) - torque);
  }

  static WalkPlan slowed(WalkPlan plan, double pace) {
    for (LegPlan& leg : plan) leg.velocity *= pace;
    return plan;
  }

  // The plan's clock stands while a foot that should be down looks for the ground: none lifts off before.
  void keep_time(const WalkPlan& plan, ControlMemory& m) const {
    bool waits = false;
    for (int l = 0; l < kLegs; ++l)
      waits = waits || (m.leg[l].phase.mode == LegMode::search && m.leg[l].phase.searched < set_.touch_down.patience &&
                        plan[l].since_down < set_.touch_down.patience);
    const double step = set_.period / kPaceTime;
    m.pace = std::clamp(waits ? 0.0 : 1.0, m.pace - step, m.pace + step);
    m.lag += set_.period * (1.0 - m.pace);
  }

  // Tilts the plane of the feet until the trunk is level.
  void level(const Felt& felt, ControlMemory& m) const {
    const double step = set_.period * set_.level_rate;
    if (step == 0.0) return;
    const double most = std::tan(set_.level_limit);
    m.roll = std::clamp(m.roll + step * felt.roll, -most, most);
    m.pitch = std::clamp(m.pitch - step * felt.pitch, -most, most);
  }

  // At lift-off the correction stays in the offset, from which the swing takes it back.
  void leave(LegMemory& leg) const {
    leg.phase.offset += leg.correction;
    leg.correction.setZero(), leg.slid.setZero();
    leg.pid = SlipMemory();
  }

  // The trunk follows the ground under its feet: height and slope of their offsets go to 0.
  void follow_ground(const WalkPlan& plan, ControlMemory& m) const {
    if (!set_.touch_down.reacts) return;
    LegVectors place;
    LegNumbers standing;
    for (int l = 0; l < kLegs; ++l) {
      place[l] = Vec3(plan[l].foot.x(), plan[l].foot.y(), m.leg[l].phase.offset.z());
      standing[l] = m.leg[l].phase.on_ground() ? 1.0 : 0.0;
    }
    const Vec3 plane = fitted_plane(place, standing);
    const double a = set_.period * set_.follow_height, b = set_.period * set_.follow_tilt;
    for (int l = 0; l < kLegs; ++l) {
      const double down = a * plane[0] + b * (plane[1] * place[l].x() + plane[2] * place[l].y());
      m.leg[l].phase.offset.z() -= down, m.leg[l].phase.left_with.z() -= down;
    }
  }

  // A foot takes up its share of the load, and gives it back, around the times of the plan; one that finds
  // no ground has none, one that finds it early takes it up at once.
  void share_load(const WalkPlan& plan, ControlMemory& m) const {
    const double half = 0.5 * set_.load_time, step = set_.period / half;
    const auto ramp = [half](double after) { return swing_share(std::clamp(0.5 + 0.5 * after / half, 0.0, 1.0)); };
    for (int l = 0; l < kLegs; ++l) {
      LegMemory& leg = m.leg[l];
      const double planned = plan[l].down ? std::min(ramp(plan[l].since_down), ramp(plan[l].until_lift))
                                          : std::max(ramp(-plan[l].since_lift), ramp(-plan[l].until_down));
      const double wanted = leg.phase.mode == LegMode::search  ? 0.0
                            : leg.phase.mode == LegMode::early ? 1.0
                                                               : planned;
      leg.share = std::clamp(wanted, leg.share - step, leg.share + step);
    }
  }

  // S1's PID on what drives the trunk nowhere, or on how far feet have slid against each other.
  void correct(const Felt& felt, ControlMemory& m) const {
    LegNumbers load;
    LegVectors error;
    for (int l = 0; l < kLegs; ++l) {
      const LegMemory& leg = m.leg[l];
      const double normal = leg.force.dot(felt.up);
      load[l] = leg.phase.on_ground() && normal > set_.threshold ? normal : 0.0;
      error[l] = leg.force - normal * felt.up;
    }
    if (set_.signal == SlipSignal::force) {
      error = internal_forces(felt.foot, error, load, felt.up);
    }
    else {
      slide(felt, load, m, error);
    }
    for (int l = 0; l < kLegs; ++l)
      if (load[l] > 0.0)
        m.leg[l].correction = slip_correction(set_.slip, set_.period, error[l], m.leg[l].pid);
  }

  // How far feet have slid on the ground since touch-down, the trunk's own motion taken out; negative, as
  // the correction goes against it.
  void slide(const Felt& felt, const LegNumbers& load, ControlMemory& m, LegVectors& error) const {
    double all = 0.0;
    Vec3 mean = Vec3::Zero();
    LegVectors moved;
    for (int l = 0; l < kLegs; ++l) {
      moved[l] = felt.moved[l] + set_.period * felt.rate.cross(felt.foot[l]);
      all += load[l], mean += load[l] * moved[l];
    }
    if (all > 0.0) mean /= all;
    for (int l = 0; l < kLegs; ++l) {
      LegMemory& leg = m.leg[l];
      if (load[l] > 0.0) leg.slid += moved[l] - mean;
      leg.slid -= felt.up * felt.up.dot(leg.slid);
      error[l] = -leg.slid;
    }
  }

  // What each foot ought to bear along the normal, N.
  LegNumbers nominal_loads(const WalkPlan& plan, const Felt& felt, const ControlMemory& m,
                           double LegMemory::*part) const {
    LegVectors place;
    LegNumbers share, load;
    double height = 0.0, all = 0.0;
    for (int l = 0; l < kLegs; ++l) {
      place[l] = plan[l].foot + m.leg[l].phase.offset;
      share[l] = m.leg[l].*part;
      height += share[l] * place[l].z(), all += share[l];
    }
    if (set_.nominal_load > 0.0) {
      for (int l = 0; l < kLegs; ++l) load[l] = share[l] * set_.nominal_load;
      return load;
    }
    const double depth = (all > 0.0 ? height / all : 0.0) - set_.centre.z();
    const Vec3 under = set_.centre + felt.down * (depth / felt.down.z());
    return weight_split(place, share, set_.weight * -felt.down.dot(felt.up), under.head<2>());
  }

  // A foot that touches takes up its part of the load as time goes on, one that does not bears nothing.
  void suspend(const WalkPlan& plan, const Felt& felt, ControlMemory& m) const {
    for (int l = 0; l < kLegs; ++l) {
      LegMemory& leg = m.leg[l];
      const double grown = leg.bearing + set_.period / set_.load_time;
      const double most = plan[l].down ? std::clamp(plan[l].until_lift / set_.load_time, 0.0, 1.0)
                          : leg.phase.on_ground() ? 1.0 : 0.0;
      leg.bearing = std::min(grown, most);
    }
    const LegNumbers load = nominal_loads(plan, felt, m, &LegMemory::bearing);
    for (int l = 0; l < kLegs; ++l) {
      const double normal = felt.touches[l] ? std::max(0.0, m.leg[l].force.dot(felt.up)) : 0.0;
      yield(set_.suspension, set_.period, normal - load[l], m.leg[l].suspension);
    }
  }

  FootControlSettings set_;
  LegReflex reflex_;
  std::vector<LegChain> legs_;
  std::vector<std::array<std::size_t, 3>> joints_;
  std::vector<std::size_t> feet_;
};

}  // namespace hexapod
