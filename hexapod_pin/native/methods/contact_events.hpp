// Switches of the contacts within a step: a foot that stops pressing before it has left the ground, because
// its damper would pull, or presses again, a bristle that breaks away or sticks again, a foot that crosses
// the edge of a patch of ground, a face of the ground that begins or ends to hold a foot which is deep in it.
// Each contact keeps its piece of the law within a step, which makes the
// right-hand side smooth; the step ends shortly after the first switch, where Plant::update_memories says
// which piece holds next.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "methods/chart_flow.hpp"
#include "methods/error_control.hpp"
#include "methods/release_scan.hpp"
#include "methods/switch_root.hpp"

namespace hexapod {

template <class PlantT>
class ContactEvents {
 public:
  ContactEvents(ChartFlow<PlantT>& flow, const ErrorNorm& norm)
      : flow_(flow), norm_(norm), start_(flow.plant.feet.size()), end_(start_) {
    PlantT& plant = flow.plant;
    bristles_ = plant.law.friction.has_bristle();
    patches_ = !plant.terrain.patches.empty();
    releases_ = plant.law.normal.can_release();
    faces_ = plant.per_foot > 1;
    plant.pieces_frozen = !plant.feet.empty() && (bristles_ || patches_ || releases_);
    idle_ = plant.feet.empty() || !(plant.pieces_frozen || faces_);
  }

  bool idle() const { return idle_; }        // nothing can switch
  bool changed() const { return changed_; }  // whether a piece has ended in the step of the last `share`

  // Whether a bristle that is frozen slides: nothing damps errors along its slip.
  bool any_sliding() const {
    const auto sliding = [](const auto& foot) { return foot.active && foot.memory.sliding; };
    const auto& feet = flow_.plant.feet;
    return bristles_ && std::any_of(feet.begin(), feet.end(), sliding);
  }

  // A step begins at the state where the plant is evaluated.
  void start() {
    if (idle_) return;
    look(start_);
    last_ = Crossing();
  }

  // A step, or another try of it, begins at t.
  void begin(double t) {
    begin_ = t;
    seen_inside_ = kNeverReached;
  }

  // Notices switches there and back again within a step; where the plant is not evaluated, nothing.
  void passed(double t, const VectorXd& y) {
    if (idle_ || seen_inside_ < kNeverReached || !is_evaluated(y)) return;
    look(inside_);
    Crossing first;
    find_first(inside_, t - begin_, first);
    if (first.share < 1.0) seen_inside_ = first.share * (t - begin_);
  }

  // Share of the step h, which ended at y, at which it should end for the first switch to be just behind
  // it; 1 where the step may end here. The plant is evaluated at y, or, where nothing is near a switch,
  // within a few tolerances of it: at a Newton iterate.
  double share(double t, const VectorXd& y, double h) {
    if (idle_) return 1.0;
    look(end_);
    if (!is_evaluated(y) && near_switch()) {
      flow_.evaluate(t, y);
      look(end_);
    }
    Crossing first;
    changed_ = find_first(end_, h, first);
    first.step = h;
    last_ = first;
    return first.share < 1.0 ? first.share : std::min(1.0, seen_inside_ / h);
  }

  // The next step begins where this one ended, in the same pieces.
  void move_on() {
    std::swap(start_, end_);
    last_ = Crossing();
  }

 private:
  static constexpr double kNeverReached = 1e300;
  // Shares of the velocity tolerance that the wrong piece behind a switch may cost.
  static constexpr double kOvershootShare = 1e-3;
  static constexpr double kReleaseShare = 1e-2;  // where a force passes through zero
  static constexpr double kIterateErrors = 30.0;  // tolerances
  // A face is taken for another where its normal has turned by more, and by more than a sphere turns it that
  // rolls over a corner.
  static constexpr double kSharpTurn = 0.05, kTimesRolling = 3.0;  // rad, -
  static constexpr double kFaceAim = 0.25;  // of the step: where in it the face has changed is not known
  static constexpr double kLeastAim = 1e-3, kMostAim = 0.5;  // of what is left of the step behind a switch

  struct Look {  // at one contact
    bool active = false, sliding = false;
    double margin = 0.0;        // of the bristle's piece, N
    double normal_force = 0.0;  // N
    int patch = -1;             // where it is
    double x = 0.0, y = 0.0;    // m
    GapState foot;              // along the normal
    double pressing = 0.0;      // normal force that may pull, N
    bool near = false;          // there is a face, touched or not
    double force = 0.0;         // N
    Vec3 normal = Vec3::Zero();
  };
  struct Crossing {
    double share = 1.0, value = 0.0, step = 0.0;
    int contact = -1, kind = -1;
  };
  enum Kind { kBristle, kPatch, kRelease, kFace };

  // Whether some contact may be in another piece within the errors of an iterate.
  bool near_switch() const {
    const FrictionLaw& law = flow_.plant.law.friction;
    const double place = kIterateErrors * norm_.tolerance, speed = place / norm_.floor;
    const double force = place * law.bristle_stiffness + speed * law.bristle_gain(0.0);
    for (std::size_t i = 0; i < end_.size(); ++i) {
      if (!start_[i].active && !end_[i].active) continue;
      if (bristles_ && end_[i].margin < force) return true;
      if (releases_ && near_release(end_[i], flow_.plant.feet[i], place, speed)) return true;
      if (!patches_) continue;
      if (end_[i].patch != flow_.plant.feet[i].memory.patch) return true;
      for (const Patch& patch : flow_.plant.terrain.patches)
        if (std::abs(patch.depth(end_[i].x, end_[i].y)) < place) return true;
    }
    return false;
  }

  template <class Contact>
  bool near_release(const Look& at, const Contact& foot, double place, double speed) const {
    if (!at.active) return true;
    const NormalForce slopes = flow_.plant.law.normal(-at.foot.gap, -at.foot.rate, foot.memory.touch_speed,
                                                      NormalPiece::pressing);
    return std::abs(slopes.force) < place * std::abs(slopes.d_depth) + speed * slopes.d_rate;
  }

  bool is_evaluated(const VectorXd& y) const {
    const Eigen::Index known = PlantT::kPrescribed ? 6 : flow_.nv;
    return flow_.velocity().head(known) == flow_.v(y).head(known);
  }

  void look(std::vector<Look>& at) const {
    const PlantT& plant = flow_.plant;
    at.resize(plant.feet.size());
    for (std::size_t i = 0; i < at.size(); ++i) {
      const auto& foot = plant.feet[i];
      Look& now = at[i];
      now.active = foot.active;
      now.sliding = foot.memory.sliding;
      now.normal_force = foot.active ? foot.ground.normal.dot(foot.contact.force) : 0.0;
      if (bristles_) now.margin = plant.piece_margin(foot);
      if (releases_) {
        now.foot.gap = foot.ground.gap;
        now.foot.rate = foot.ground.gap < kFarAway ? foot.ground.normal.dot(foot.velocity) : 0.0;
        now.pressing = now.active ? plant.pressing_force(foot) : 0.0;
      }
      if (faces_) {
        now.near = foot.ground.gap < kFarAway;
        now.force = foot.active ? foot.contact.force.norm() : 0.0;
        now.normal = foot.ground.normal;
      }
      if (!patches_) continue;
      now.x = plant.center(foot).x(), now.y = plant.center(foot).y();
      now.patch = plant.terrain.patch_at(now.x, now.y);
    }
  }

  // The first switch between the start of the step and a state h later; whether there is any.
  bool find_first(const std::vector<Look>& end, double h, Crossing& first) const {
    const PlantT& plant = flow_.plant;
    const double allowed = norm_.tolerance / norm_.weight(h);  // m/s
    const double most = kOvershootShare * allowed;
    bool any = false;
    for (std::size_t i = 0; i < end.size(); ++i) {
      if (!start_[i].active && !end[i].active) continue;
      if (bristles_ && end[i].margin < 0.0) {
        any = true;
        offer(i, kBristle, start_[i].margin, end[i].margin, jump_at_end(i, end[i]), h, most, first);
      }
      if (releases_ && start_[i].active && end[i].foot.gap < kFarAway)
        any |= offer_release(i, end[i], h, kReleaseShare * allowed, first);
      if (faces_) any |= offer_face(i, end[i], h, most, first);
      const int patch = plant.feet[i].memory.patch;
      if (patches_ && end[i].patch != patch) {
        any = true;
        const auto [before, after] = edge_margins(patch, start_[i], end[i]);
        offer(i, kPatch, before, after, patch_jump(patch, end[i]), h, most, first);
      }
    }
    return any;
  }

  // Force [N] that is wrong behind a switch of the bristle, by the end of the step.
  double jump_at_end(std::size_t i, const Look& end) const {
    const PlantT& plant = flow_.plant;
    const FrictionLaw& law = plant.law.friction;
    const double step = end.sliding ? 0.0 : law.coefficient(false) - law.coefficient(true);
    return plant.feet[i].mu_scale * step * end.normal_force - end.margin;
  }

  double patch_jump(int from, const Look& end) const {
    const Terrain& terrain = flow_.plant.terrain;
    const auto [mu_old, k_old] = terrain.patch_factors(from);
    const auto [mu_new, k_new] = terrain.patch_factors(end.patch);
    const double mu = flow_.plant.law.friction.largest_coefficient();
    return end.normal_force * (mu * std::abs(mu_new - mu_old) + std::abs(k_new - k_old) / k_old);
  }

  // Depths in the patch that decides between two of them, the first in the list; above zero before.
  std::pair<double, double> edge_margins(int from, const Look& start, const Look& end) const {
    const bool leaves = end.patch < 0 || (from >= 0 && from < end.patch);
    const Patch& edge = flow_.plant.terrain.patches[std::size_t(leaves ? from : end.patch)];
    const double sign = leaves ? 1.0 : -1.0;
    return {sign * edge.depth(start.x, start.y), sign * edge.depth(end.x, end.y)};
  }

  // A crossing of contact i, of a switch with these values at both ends of h.
  void offer(std::size_t i, Kind kind, double before, double after, double jump, double h, double most,
             Crossing& first) const {
    const bool again = last_.contact == int(i) && last_.kind == int(kind);
    const double root = switch_root(before, after, h, again ? EarlierTry{last_.step, last_.value} : EarlierTry());
    offer_root(i, kind, root, after, jump, h, most, first);
  }

  void offer_root(std::size_t i, Kind kind, double root, double after, double jump, double h, double most,
                  Crossing& first) const {
    const double rest = 1.0 - root, excess = jump * mobility(i) * rest * h;
    if (!(excess > most)) return;
    const double share = root + std::clamp(0.5 * most / excess, kLeastAim, kMostAim) * rest;
    if (share < first.share) first = {share, after, h, int(i), int(kind)};
  }

  // Whether contact i stops pressing, or presses again, within h; where it stays out of its piece.
  bool offer_release(std::size_t i, const Look& end, double h, double most, Crossing& first) const {
    const auto& foot = flow_.plant.feet[i];
    const Release found = find_release(flow_.plant.law.normal, foot.memory.touch_speed,
                                       foot.memory.released, start_[i].foot, end.foot);
    const double wrong = foot.k_scale * found.force;
    if (found.share < 1.0) offer_root(i, kRelease, found.share, end.pressing, wrong, h, most, first);
    return end.active && (end.pressing > 0.0) == foot.memory.released;
  }

  // Whether contact i stands on another face than at the start, or on none, deep as it is.
  bool offer_face(std::size_t i, const Look& end, double h, double most, Crossing& first) const {
    const Look& start = start_[i];
    double jump = 0.0;  // N
    if (!start.near || !end.near) jump = std::max(start.force, end.force);
    else if (start.active && end.active) jump = end.force * sharp_turn(i, start, end, h);
    if (jump * mobility(i) * h > most && kFaceAim < first.share) first = {kFaceAim, jump, h, int(i), int(kFace)};
    return jump > 0.0;
  }

  // By how much the normal has turned, rad; 0 where that is what rolling over a corner does.
  double sharp_turn(std::size_t i, const Look& start, const Look& end, double h) const {
    const PlantT& plant = flow_.plant;
    const auto& foot = plant.feet[i];
    const double turn = (end.normal - start.normal).norm();
    const double distance = plant.mounts[plant.foot_of(i)].radius + std::abs(foot.ground.gap);
    return turn > kSharpTurn && turn * distance > kTimesRolling * h * foot.velocity.norm() ? turn : 0.0;
  }

  // Velocity of a foot per impulse on it, no joint being coupled to another, 1/kg.
  double mobility(std::size_t i) const {
    const PlantT& plant = flow_.plant;
    double most = 1.0 / plant.dynamics.total_mass();
    if constexpr (PlantT::kPrescribed) return most;
    for (std::size_t k = 0; k < plant.columns(i).size(); ++k) {
      const Eigen::Index c = Tree::column(plant.columns(i)[k]);
      most = std::max(most, plant.feet[i].jl.col(Eigen::Index(k)).squaredNorm() / plant.mass_upper()(c, c));
    }
    return most;
  }

  ChartFlow<PlantT>& flow_;
  ErrorNorm norm_;
  std::vector<Look> start_, end_, inside_;
  double begin_ = 0.0, seen_inside_ = kNeverReached;
  Crossing last_;
  bool bristles_ = false, patches_ = false, releases_ = false, faces_ = false;  // that can switch in this scene
  bool idle_ = false, changed_ = false;
};

}  // namespace hexapod
