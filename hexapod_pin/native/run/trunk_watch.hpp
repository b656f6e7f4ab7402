// Notices where points of the trunk touch the ground, whether the ground pushes on them or not.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "laws/terrain.hpp"
#include "methods/hermite.hpp"
#include "plant/dynamics.hpp"

namespace hexapod {

struct TrunkPoint {
  Vec3 offset;    // base axes, from the base's origin, m
  double radius;  // m
};

struct TrunkTouch {
  double time;        // s
  std::size_t point;  // in the list of points
  Vec3 place;         // of the point, world axes, m
};

class TrunkWatch {
 public:
  TrunkWatch() = default;
  explicit TrunkWatch(std::vector<TrunkPoint> points)
      : points_(std::move(points)), before_(points_.size()) {
    for (const TrunkPoint& p : points_) reach_ = std::max(reach_, p.offset.norm() + p.radius);
  }

  // At an accepted state, `origin` that of the base. A trunk that cannot have reached the ground since
  // it was last looked at is not looked at; one that has reached it did so between the two looks, where the
  // cubic by gaps and their rates does.
  void look(const Terrain& terrain, const Mat3& rotation, const Vec3& origin, const VectorXd& v,
            double t) {
    if (points_.empty()) return;
    const double speed = v.head<3>().norm() + reach_ * v.segment<3>(3).norm();
    fastest_ = std::max(fastest_, speed);
    if (t < next_look_ && fastest_ <= bound_) return;
    double nearest = kFarAway;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vec3 place = origin + rotation * points_[i].offset;
      GroundPoints ground;
      terrain.find_contacts(place, points_[i].radius, t, ground);
      const double gap = std::min(ground[0].gap, ground[1].gap);
      nearest = std::min(nearest, gap);
      const Vec3& normal = ground[ground[1].gap < ground[0].gap].normal;
      const Vec3 velocity = rotation * (v.head<3>() + v.segment<3>(3).cross(points_[i].offset));
      const Look now{gap, normal.dot(velocity), place}, &before = before_[i];
      if (gap < 0.0 && before.gap >= 0.0 && touches_.size() < kMostTouches) {
        const double h = t - last_look_;
        const double part = before.gap < kFarAway
            ? hermite_root(before.gap, h * before.rate, gap, h * now.rate) : 1.0;
        touches_.push_back({last_look_ + part * h, i, before.place + part * (place - before.place)});
      }
      before_[i] = now;
    }
    last_look_ = t;
    bound_ = kSpeedMargin * speed + kLeastSpeed;
    fastest_ = speed;
    next_look_ = nearest > 0.0 ? t + nearest / bound_ : t;
  }

  const std::vector<TrunkTouch>& touches() const { return touches_; }

 private:
  static constexpr std::size_t kMostTouches = 1000;
  static constexpr double kSpeedMargin = 2.0;  // -
  static constexpr double kLeastSpeed = 0.5;   // m/s; covers shaking ground too

  struct Look {
    double gap = kFarAway, rate = 0.0;  // m, m/s
    Vec3 place = Vec3::Zero();          // m
  };

  std::vector<TrunkPoint> points_;
  std::vector<Look> before_;  // at each, when last looked at
  std::vector<TrunkTouch> touches_;
  double reach_ = 0.0, fastest_ = 0.0, bound_ = 0.0;
  double next_look_ = -std::numeric_limits<double>::infinity(), last_look_ = 0.0;  // s
};

}  // namespace hexapod
