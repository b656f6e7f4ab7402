// The planned motion of six feet in the trunk's frame as a table over time, and the gait's schedule.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "laws/vectors.hpp"

namespace hexapod {

constexpr int kLegs = 6;

// What the plan says of a leg at one time.
struct LegPlan {
  Vec3 foot, velocity;  // of the foot's centre, trunk frame, m, m/s
  bool down;            // whether it stands
  double share;         // of its swing that is over, 0 to 1
  double since_down, until_lift;  // while it stands, s
  double since_lift, until_down;  // while it swings, s
};

using WalkPlan = std::array<LegPlan, kLegs>;

class WalkTable {
 public:
  // Placements as shares of the cycle, share of it on the ground, cycle time and spacing in s; the rows
  // repeat from `repeat_from` on every cycle, or end where they end where that is negative.
  WalkTable(const std::array<double, kLegs>& phases, double duty, double cycle, double spacing,
            double repeat_from)
      : phases_(phases), duty_(duty), cycle_(cycle), spacing_(spacing), repeat_from_(repeat_from) {}

  // Foot positions and velocities at the next time; whether a foot stays where it is in its swing; the
  // body's forward and lateral speed and yaw rate.
  void append(const double* foot, const double* velocity, const bool* still, const double* twist) {
    Row row;
    for (int l = 0; l < kLegs; ++l) {
      row.foot[l] = Vec3(foot[3 * l], foot[3 * l + 1], foot[3 * l + 2]);
      row.velocity[l] = Vec3(velocity[3 * l], velocity[3 * l + 1], velocity[3 * l + 2]);
      row.still[l] = still[l];
    }
    row.twist = Vec3(twist[0], twist[1], twist[2]);
    rows_.push_back(row);
  }

  double end() const { return spacing_ * double(rows_.size() - 1); }
  bool repeats() const { return repeat_from_ >= 0.0; }

  // The plan at a time (0 at the earliest; at the table's end what does not repeat stands still).
  WalkPlan at(double time) const {
    WalkPlan plan;
    const auto [row, s] = place(time);
    const Row &a = rows_[row], &b = rows_[row + 1];
    const double h = spacing_, s2 = s * s, s3 = s2 * s;
    for (int l = 0; l < kLegs; ++l) {
      LegPlan& leg = plan[l];
      leg.foot = (1.0 - 3.0 * s2 + 2.0 * s3) * a.foot[l] + (3.0 * s2 - 2.0 * s3) * b.foot[l] +
                 h * ((s - 2.0 * s2 + s3) * a.velocity[l] + (s3 - s2) * b.velocity[l]);
      leg.velocity = 6.0 * (s - s2) / h * (b.foot[l] - a.foot[l]) +
                     (1.0 - 4.0 * s + 3.0 * s2) * a.velocity[l] + (3.0 * s2 - 2.0 * s) * b.velocity[l];
      schedule(time, l, leg);
    }
    return plan;
  }

  // Velocity of the ground under a foot at `p` as the walking trunk sees it, m/s.
  Vec3 ground_velocity(double time, const Vec3& p) const {
    const auto [row, s] = place(time);
    const Vec3 twist = (1.0 - s) * rows_[row].twist + s * rows_[row + 1].twist;
    return {twist.z() * p.y() - twist.x(), -twist.z() * p.x() - twist.y(), 0.0};
  }

 private:
  static constexpr double kLong = 1e9;  // s

  struct Row {
    std::array<Vec3, kLegs> foot, velocity;
    std::array<bool, kLegs> still;
    Vec3 twist;
  };

  std::pair<std::size_t, double> place(double time) const {
    double t = std::max(time, 0.0);
    if (repeats() && t > repeat_from_ + cycle_)
      t -= std::floor((t - repeat_from_) / cycle_) * cycle_;
    const double cell = std::min(t, end()) / spacing_;
    const auto row = std::min(std::size_t(cell), rows_.size() - 2);
    return {row, cell - double(row)};
  }

  // Whether a foot stays where it is in the swing that has this middle.
  bool still(double middle, int l) const { return rows_[place(middle).first].still[l]; }

  void schedule(double time, int l, LegPlan& leg) const {
    const double cycles = time / cycle_ - phases_[l];
    const double age = cycles - std::floor(cycles);
    const double aloft = 1.0 - duty_;
    leg.down = age < duty_;
    leg.share = leg.down ? 0.0 : (age - duty_) / aloft;
    leg.since_down = age * cycle_, leg.until_lift = (duty_ - age) * cycle_;
    leg.since_lift = -leg.until_lift, leg.until_down = (1.0 - age) * cycle_;
    const double swing = leg.down ? leg.until_lift : leg.since_lift;  // to the next one, or into this
    const double middle = time + (leg.down ? swing : -swing) + 0.5 * aloft * cycle_;
    if (leg.down) {
      const bool stood = leg.since_down >= time || still(middle - cycle_, l);
      if (stood) leg.since_down = kLong;
      if (still(middle, l)) leg.until_lift += cycle_;
    } else if (still(middle, l)) {
      leg.down = true, leg.share = 0.0;
      leg.since_down = kLong, leg.until_lift += cycle_;
    }
  }

  std::array<double, kLegs> phases_;
  double duty_, cycle_, spacing_, repeat_from_;
  std::vector<Row> rows_;
};

}  // namespace hexapod
