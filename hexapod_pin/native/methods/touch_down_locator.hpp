// Locates touch-downs within a step, and lift-offs on request, so that no step passes over first
// contact.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "methods/hermite.hpp"
#include "plant/plant.hpp"

namespace hexapod {

class TouchDownLocator {
 public:
  // `tolerance` of places [m]. `speed_remembered`: the law depends on the speed at each first touch, so
  // that a foot which leaves and comes back within a step meets another law.
  TouchDownLocator(std::size_t contacts, double tolerance, bool speed_remembered, bool lift_off = false)
      : gap_(contacts), rate_(contacts), slack_(std::clamp(1e-3 * tolerance, 1e-12, 1e-7)),
        speed_remembered_(speed_remembered), lift_off_(lift_off) {}

  // Stores the gaps at the start of a step; the plant is evaluated there, separated feet too.
  template <class PlantT>
  void begin(const PlantT& plant) {
    for (std::size_t i = 0; i < gap_.size(); ++i) {
      gap_[i] = plant.feet[i].ground.gap;
      rate_[i] = rate(plant.feet[i]);
    }
  }

  // Share of the step h, whose end is evaluated, after which the first foot changes; 1 if none does.
  template <class PlantT>
  double share(const PlantT& plant, double h) const {
    double first = 1.0;
    for (std::size_t i = 0; i < gap_.size(); ++i) {
      const double end = plant.feet[i].ground.gap;
      if (gap_[i] > slack_ && gap_[i] < kFarAway && end < -slack_)
        first = std::min(first, hermite_root(gap_[i], h * rate_[i], end, h * rate(plant.feet[i])));
      if (gap_[i] > slack_ && end > slack_ && end < kFarAway)
        first = std::min(first, crossed_between({gap_[i], h * rate_[i], end, h * rate(plant.feet[i])}));
      if (std::abs(gap_[i]) <= slack_ && end < -slack_)
        first = std::min(first, returned_between({gap_[i], h * rate_[i], end, h * rate(plant.feet[i])}));
      if (speed_remembered_ && gap_[i] < -slack_ && end < -slack_)
        first = std::min(first, left_between(i, end, h, rate(plant.feet[i])));
      if (lift_off_ && gap_[i] < -slack_ && end > slack_ && end < kFarAway)
        first = std::min(first, hermite_root(-gap_[i], -h * rate_[i], -end, -h * rate(plant.feet[i])));
    }
    return first;
  }

  // Longest step [s] in which no foot can meet the ground and leave it unseen: an eighth of the period
  // of ground that shakes, while a foot may reach it within that.
  template <class PlantT>
  double longest_step(const PlantT& plant) const {
    if (plant.terrain.amplitude == 0.0) return std::numeric_limits<double>::infinity();
    const double share = 0.25 * 3.14159265358979323846 / std::abs(plant.terrain.rate);
    for (std::size_t i = 0; i < gap_.size(); ++i) {
      const double reach = 2.0 * std::abs(plant.terrain.amplitude) + 2.0 * share * std::abs(rate_[i]);
      if (gap_[i] < reach) return share;
    }
    return std::numeric_limits<double>::infinity();
  }

 private:
  struct Ends {  // values and slopes of a cubic at 0 and 1
    double a, da, b, db;
  };

  // Share of a step that begins and ends with a foot in the air, at which it touches down in between.
  double crossed_between(const Ends& e) const {
    if (!(e.da < 0.0) || !(e.db > 0.0)) return 1.0;
    if (e.a + e.da > 0.0 && e.b - e.db > 0.0) return 1.0;  // its tangents stay above
    double where = 0.0;
    const double least = hermite_minimum(e.a, e.da, e.b, e.db, where);
    if (!(least < -slack_)) return 1.0;
    return where * hermite_root(e.a, where * e.da, least, 0.0);
  }

  // The same for one that begins at the surface, its foot on the way out, and ends in the ground.
  double returned_between(const Ends& e) const {
    if (!(e.da > 0.0) || !(e.db < 0.0)) return 1.0;
    double where = 0.0;
    const double most = -hermite_minimum(-e.a, -e.da, -e.b, -e.db, where), rest = 1.0 - where;
    if (!(most > 2.0 * slack_)) return 1.0;
    return where + rest * hermite_root(most, 0.0, e.b, rest * e.db);
  }

  // The same for one that begins and ends in the ground: where it is clear of it by two slacks, so that
  // its way back is seen.
  double left_between(std::size_t i, double end, double h, double end_rate) const {
    const double clear = 2.0 * slack_;
    return crossed_between({clear - gap_[i], -h * rate_[i], clear - end, -h * end_rate});
  }

  template <class Foot>
  static double rate(const Foot& foot) {
    return foot.ground.gap < kFarAway ? foot.ground.normal.dot(foot.velocity) : 0.0;
  }

  std::vector<double> gap_, rate_;
  double slack_;
  bool speed_remembered_, lift_off_;
};

}  // namespace hexapod
