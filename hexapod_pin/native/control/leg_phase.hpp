// What a leg does: it follows the plan but for what it feels. A foot that meets the ground early stays
// there, one that finds none goes on down, one that runs against an obstacle rises over it.
#pragma once

#include <algorithm>
#include <cmath>

#include "control/walk_table.hpp"
#include "laws/vectors.hpp"

namespace hexapod {

struct TouchDownSettings {
  bool reacts = false;        // whether a leg yields to what it feels
  double earliest = 0.0;      // share of the swing before which no ground is expected
  double search_speed = 0.0;  // m/s
  double search_depth = 0.0;  // below the plan, m
  double rise_speed = 0.0;    // of a foot that runs against something, m/s
  double rise_limit = 0.0;    // above the plan, m
  double retreat = 0.0;       // speed at which such a foot gives way, m/s
  double patience = 0.0;      // longest time that the plan waits for a foot, s
  double lost_after = 0.0;    // time without load after which a foot has lost the ground, s
};

// Early: on the ground before the plan has it so. Search: not there although the plan has it so.
enum class LegMode { down, swing, early, search };

struct LegPhase {
  LegMode mode = LegMode::down;
  double without_load = 0.0;        // s
  double searched = 0.0;            // how long it has looked for the ground, s
  Vec3 offset = Vec3::Zero();       // from the plan, trunk axes, m
  Vec3 left_with = Vec3::Zero();    // the offset at lift-off, m
  Vec3 lag = Vec3::Zero();          // horizontal, of a foot that was held up, m
  double rise = 0.0;                // of such a foot, m

  bool on_ground() const { return mode == LegMode::down || mode == LegMode::early; }
};

// What a foot feels, trunk axes.
struct FootTouch {
  Vec3 force;    // of the ground on it, N
  bool touches;  // whether that is one
  bool free;     // whether there is none; in between a foot stays as it is
  Vec3 up;       // normal of the support
};

// 10 s^3 - 15 s^4 + 6 s^5: share of a swing's way that is done.
inline double swing_share(double s) { return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s); }

class LegReflex {
 public:
  LegReflex(const TouchDownSettings& settings, double period) : set_(settings), period_(period) {}

  // The next tick of a leg; `ground`: velocity of the ground at the foot as the trunk sees it, m/s.
  void step(const LegPlan& plan, const FootTouch& felt, const Vec3& ground, LegPhase& leg) const {
    leg.without_load = felt.free ? leg.without_load + period_ : 0.0;
    if (plan.down) stand(felt, leg);
    else fly(plan, felt, ground, leg);
  }

 private:
  void stand(const FootTouch& felt, LegPhase& leg) const {
    const bool has_stood = leg.mode == LegMode::down && leg.without_load <= set_.lost_after;
    leg.mode = felt.touches || has_stood || !set_.reacts ? LegMode::down : LegMode::search;
    leg.searched = leg.mode == LegMode::search ? leg.searched + period_ : 0.0;
    if (leg.mode == LegMode::search && felt.free)
      leg.offset.z() = std::max(leg.offset.z() - period_ * set_.search_speed,
                                std::min(leg.offset.z(), -set_.search_depth));
  }

  void fly(const LegPlan& plan, const FootTouch& felt, const Vec3& ground, LegPhase& leg) const {
    if (leg.mode == LegMode::early) {  // stays where it is on the ground
      leg.offset += period_ * (ground - plan.velocity);
      return;
    }
    if (leg.mode != LegMode::swing) {
      leg.mode = LegMode::swing;
      leg.left_with = leg.offset, leg.lag.setZero(), leg.rise = 0.0;
    }
    if (set_.reacts && felt.touches) meet(plan, felt, ground, leg);
    if (leg.mode == LegMode::early) return;
    leg.lag *= std::exp(-period_ / kCatchUp);
    const double fade = 1.0 - swing_share(std::max(0.0, (plan.share - kDescent) / (1.0 - kDescent)));
    leg.offset = leg.left_with * (1.0 - swing_share(plan.share)) + leg.lag;
    leg.offset.z() += leg.rise * fade;
  }

  // A swinging foot feels something.
  void meet(const LegPlan& plan, const FootTouch& felt, const Vec3& ground, LegPhase& leg) const {
    const double along = felt.force.dot(felt.up), size = felt.force.norm();
    if (plan.share > set_.earliest && along > kSteepest * size) {
      leg.mode = LegMode::early;
      return;
    }
    const Vec3 way = plan.velocity - ground;
    if (plan.share < kLeaves || along > kSteepest * size || felt.force.dot(way) >= 0.0) return;
    leg.rise = std::min(leg.rise + period_ * set_.rise_speed, set_.rise_limit);
    Vec3 back = -plan.velocity;
    if (const double speed = way.head<2>().norm(); speed > 0.0) back -= way * (set_.retreat / speed);
    leg.lag.head<2>() += period_ * back.head<2>();
  }

  static constexpr double kSteepest = 0.7;  // cosine of the steepest ground to stand on
  static constexpr double kLeaves = 0.1;    // share of a swing in which the foot still leaves the ground
  static constexpr double kDescent = 0.6;   // share of a swing from which a rise is taken back
  static constexpr double kCatchUp = 0.05;  // s

  TouchDownSettings set_;
  double period_;  // s
};

}  // namespace hexapod
