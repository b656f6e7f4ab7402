#include "methods/contact_events.hpp"

#include <algorithm>
#include <cmath>

#include "methods/release_scan.hpp"
#include "methods/switch_root.hpp"
#include "plant/arrow.hpp"
#include "plant/dense.hpp"
#include "plant/prescribed_system.hpp"

namespace hexapod {

template <class PlantT>
ContactEvents<PlantT>::ContactEvents(ChartFlow<PlantT>& flow, const ErrorNorm& norm)
    : flow_(flow), norm_(norm), start_(flow.plant.feet.size()), end_(start_) {
  PlantT& plant = flow.plant;
  bristles_ = plant.law.friction.has_bristle();
  patches_ = !plant.terrain.patches.empty();
  releases_ = plant.law.normal.can_release();
  faces_ = plant.per_foot > 1;
  plant.pieces_frozen = !plant.feet.empty() && (bristles_ || patches_ || releases_);
  idle_ = plant.feet.empty() || !(plant.pieces_frozen || faces_);
}

template <class PlantT>
bool ContactEvents<PlantT>::any_sliding() const {
  const auto sliding = [](const auto& foot) { return foot.active && foot.memory.sliding; };
  const auto& feet = flow_.plant.feet;
  return bristles_ && std::any_of(feet.begin(), feet.end(), sliding);
}

template <class PlantT>
void ContactEvents<PlantT>::start() {
  if (idle_) return;
  look(start_);
  last_ = Crossing();
}

template <class PlantT>
void ContactEvents<PlantT>::begin(double t) {
  begin_ = t;
  seen_inside_ = kNeverReached;
}

template <class PlantT>
void ContactEvents<PlantT>::passed(double t, const VectorXd& y) {
  if (idle_ || seen_inside_ < kNeverReached || !is_evaluated(y)) return;
  look(inside_);
  Crossing first;
  find_first(inside_, t - begin_, first);
  if (first.share < 1.0) seen_inside_ = first.share * (t - begin_);
}

template <class PlantT>
double ContactEvents<PlantT>::share(double t, const VectorXd& y, double h) {
  if (idle_) return 1.0;
  look(end_);
  if (!is_evaluated(y) && near_switch(y)) {
    flow_.evaluate(t, y);
    look(end_);
  }
  Crossing first;
  changed_ = find_first(end_, h, first);
  first.step = h;
  last_ = first;
  return first.share < 1.0 ? first.share : std::min(1.0, seen_inside_ / h);
}

template <class PlantT>
void ContactEvents<PlantT>::move_on() {
  std::swap(start_, end_);
  last_ = Crossing();
}

template <class PlantT>
inline bool ContactEvents<PlantT>::near_switch(const VectorXd& y) const {
  const FrictionLaw& law = flow_.plant.law.friction;
  const double place = kReach * (flow_.xi(y) - flow_.coordinates()).cwiseAbs().maxCoeff();
  const double speed = kReach * (flow_.v(y) - flow_.velocity()).cwiseAbs().maxCoeff();
  const double force = place * law.bristle_stiffness + speed * law.bristle_gain(0.0);
  for (std::size_t i = 0; i < end_.size(); ++i) {
    if (!start_[i].active && !end_[i].active) continue;
    if (bristles_ && end_[i].margin < force) return true;
    if (releases_ && near_release(end_[i], flow_.plant.feet[i], place, speed)) return true;
    if (!patches_) continue;
    if (end_[i].patch != flow_.plant.feet[i].memory.patch) return true;
    for (const Patch& patch : flow_.plant.terrain.patches)
      if (std::abs(patch.depth(end_[i].x, end_[i].y)) < place + kEdgeWidth) return true;
  }
  return false;
}

template <class PlantT>
inline bool ContactEvents<PlantT>::near_release(const Look& at, const typename PlantT::Contact& foot,
                                                double place,
                                         double speed) const {
  if (!at.active) return true;
  const NormalForce slopes = flow_.plant.law.normal(-at.foot.gap, -at.foot.rate, foot.memory.touch_speed,
                                                    NormalPiece::pressing);
  return std::abs(slopes.force) < place * std::abs(slopes.d_depth) + speed * slopes.d_rate;
}

template <class PlantT>
inline bool ContactEvents<PlantT>::is_evaluated(const VectorXd& y) const {
  const Eigen::Index known = PlantT::kPrescribed ? 6 : flow_.nv;
  return flow_.velocity().head(known) == flow_.v(y).head(known);
}

template <class PlantT>
inline void ContactEvents<PlantT>::look(std::vector<Look>& at) const {
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
    now.patch = plant.terrain.patch_after(foot.memory.patch, foot.memory.left, now.x, now.y);
  }
}

template <class PlantT>
inline bool ContactEvents<PlantT>::find_first(const std::vector<Look>& end, double h, Crossing& first) const {
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
      const double beyond = end[i].patch == plant.feet[i].memory.left ? kEdgeWidth : 0.0;
      const auto margin = [&](const Look& at) {
        return beyond + plant.terrain.signed_depth(patch, end[i].patch, at.x, at.y);
      };
      offer(i, kPatch, margin(start_[i]), margin(end[i]), patch_jump(patch, end[i]), h, most, first);
    }
  }
  return any;
}

template <class PlantT>
inline double ContactEvents<PlantT>::jump_at_end(std::size_t i, const Look& end) const {
  const PlantT& plant = flow_.plant;
  const FrictionLaw& law = plant.law.friction;
  const double step = end.sliding ? 0.0 : law.coefficient(false) - law.coefficient(true);
  return plant.feet[i].mu_scale * step * end.normal_force - end.margin;
}

template <class PlantT>
inline double ContactEvents<PlantT>::patch_jump(int from, const Look& end) const {
  const Terrain& terrain = flow_.plant.terrain;
  const auto [mu_old, k_old] = terrain.patch_factors(from);
  const auto [mu_new, k_new] = terrain.patch_factors(end.patch);
  const double mu = flow_.plant.law.friction.largest_coefficient();
  return end.normal_force * (mu * std::abs(mu_new - mu_old) + std::abs(k_new - k_old) / k_old);
}

template <class PlantT>
inline void ContactEvents<PlantT>::offer(std::size_t i, Kind kind, double before, double after, double jump,
                                  double h, double most, Crossing& first) const {
  const bool again = last_.contact == int(i) && last_.kind == int(kind);
  const double root = switch_root(before, after, h, again ? EarlierTry{last_.step, last_.value} : EarlierTry());
  offer_root(i, kind, root, after, jump, h, most, first);
}

template <class PlantT>
inline void ContactEvents<PlantT>::offer_root(std::size_t i, Kind kind, double root, double after, double jump,
                                       double h, double most, Crossing& first) const {
  const double rest = 1.0 - root, excess = jump * mobility(i) * rest * h;
  if (!(excess > most)) return;
  const double share = root + std::clamp(0.5 * most / excess, kLeastAim, kMostAim) * rest;
  if (share < first.share) first = {share, after, h, int(i), int(kind)};
}

template <class PlantT>
inline bool ContactEvents<PlantT>::offer_release(std::size_t i, const Look& end, double h, double most,
                                          Crossing& first) const {
  const auto& foot = flow_.plant.feet[i];
  const Release found = find_release(flow_.plant.law.normal, foot.memory.touch_speed,
                                     foot.memory.released, start_[i].foot, end.foot);
  const double wrong = foot.k_scale * found.force;
  if (found.share < 1.0) offer_root(i, kRelease, found.share, end.pressing, wrong, h, most, first);
  return end.active && (end.pressing > 0.0) == foot.memory.released;
}

template <class PlantT>
inline bool ContactEvents<PlantT>::offer_face(std::size_t i, const Look& end, double h, double most,
                                       Crossing& first) const {
  const Look& start = start_[i];
  double jump = 0.0;  // N
  if (!start.near || !end.near) jump = std::max(start.force, end.force);
  else if (start.active && end.active) jump = end.force * sharp_turn(i, start, end, h);
  if (jump * mobility(i) * h > most && kFaceAim < first.share) first = {kFaceAim, jump, h, int(i), int(kFace)};
  return jump > 0.0;
}

template <class PlantT>
inline double ContactEvents<PlantT>::sharp_turn(std::size_t i, const Look& start, const Look& end,
                                                double h) const {
  const PlantT& plant = flow_.plant;
  const auto& foot = plant.feet[i];
  const double turn = (end.normal - start.normal).norm();
  const double distance = plant.mounts[plant.foot_of(i)].radius + std::abs(foot.ground.gap);
  return turn > kSharpTurn && turn * distance > kTimesRolling * h * foot.velocity.norm() ? turn : 0.0;
}

template <class PlantT>
inline double ContactEvents<PlantT>::mobility(std::size_t i) const {
  const PlantT& plant = flow_.plant;
  double most = 1.0 / plant.dynamics.total_mass();
  if constexpr (PlantT::kPrescribed) return most;
  for (std::size_t k = 0; k < plant.columns(i).size(); ++k) {
    const Eigen::Index c = Tree::column(plant.columns(i)[k]);
    most = std::max(most, plant.feet[i].jl.col(Eigen::Index(k)).squaredNorm() / plant.mass_upper()(c, c));
  }
  return most;
}

template class ContactEvents<Plant<ArrowSystem>>;
template class ContactEvents<Plant<DenseSystem>>;
template class ContactEvents<Plant<PrescribedSystem>>;

}  // namespace hexapod
