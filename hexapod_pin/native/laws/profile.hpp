// Ground whose height is a polyline along one direction: stairs, ledges, grooves.
#pragma once

#include <cmath>
#include <stdexcept>
#include <vector>

#include "laws/ground.hpp"

namespace hexapod {

class Profile {
 public:
  // Points with non-decreasing x; equal x: a vertical riser. Beyond the ends the ground is level.
  Profile(double heading, std::vector<double> x, std::vector<double> z)
      : along_(std::cos(heading), std::sin(heading), 0.0), x_(std::move(x)), z_(std::move(z)) {
    if (x_.size() < 2 || x_.size() != z_.size())
      throw std::invalid_argument("a profile needs at least two points");
    x_.insert(x_.begin(), x_.front() - kFarAway);
    z_.insert(z_.begin(), z_.front());
    x_.push_back(x_.back() + kFarAway);
    z_.push_back(z_.back());
  }

  int find_contacts(const Vec3& center, double radius, GroundPoints& out) const {
    const Eigen::Vector2d c(along_.dot(center), center.z());
    return inside(c) ? from_inside(c, radius, out) : from_outside(c, radius, out);
  }

 private:
  Vec2 at(std::size_t i) const { return {x_[i], z_[i]}; }

  Vec2 face_normal(std::size_t i) const {  // of segment i, out of the ground (left of +x travel)
    const Vec2 d = at(i + 1) - at(i);
    return Vec2(-d.y(), d.x()).normalized();
  }

  bool inside(const Vec2& c) const {
    std::size_t i = 0;
    while (i + 2 < x_.size() && x_[i + 1] <= c.x()) ++i;
    const double s = (c.x() - x_[i]) / (x_[i + 1] - x_[i]);
    return c.y() < z_[i] + s * (z_[i + 1] - z_[i]);
  }

  // Sphere centre above ground: every face it projects onto and every corner it is nearest to gives a
  // contact along the line from the nearest point; the two nearest count.
  int from_outside(const Vec2& c, double radius, GroundPoints& out) const {
    int count = 0;
    double gaps[kMaxContacts] = {kFarAway, kFarAway};
    for (std::size_t i = 0; i + 1 < x_.size(); ++i) {
      const Vec2 a = at(i), d = at(i + 1) - a;
      const double s = d.dot(c - a) / d.squaredNorm();
      const Vec2 n = face_normal(i);
      if (s > 0.0 && s <= 1.0 && n.dot(c - a) >= 0.0)
        count = keep(n.dot(c - a) - radius, n, gaps, out, count);
      if (i > 0 && s <= 0.0 && past_previous(i, c)) {
        const Vec2 r = c - a;
        const double distance = r.norm();
        if (distance > 0.0) count = keep(distance - radius, r / distance, gaps, out, count);
      }
    }
    return count;
  }

  bool past_previous(std::size_t i, const Vec2& c) const {  // beyond the end of segment i - 1
    const Vec2 a = at(i - 1), d = at(i) - a;
    return d.dot(c - a) > d.squaredNorm();
  }

  // Centre below the surface (point feet, deep starts): the nearest face, with negative distance.
  int from_inside(const Vec2& c, double radius, GroundPoints& out) const {
    double best = kFarAway;
    for (std::size_t i = 0; i + 1 < x_.size(); ++i) {
      const Vec2 a = at(i), d = at(i + 1) - a;
      const double s = std::min(std::max(d.dot(c - a) / d.squaredNorm(), 0.0), 1.0);
      const Vec2 r = a + s * d - c;
      const double distance = r.norm();
      if (distance >= best) continue;
      best = distance;
      const bool face = s > 0.0 && s < 1.0;
      out[0] = {-distance - radius, lifted(face || distance == 0.0 ? face_normal(i) : Vec2(r / distance))};
    }
    return 1;
  }

  int keep(double gap, const Vec2& n, double* gaps, GroundPoints& out, int count) const {
    // faces in one line meet in one contact
    for (int k = 0; k < count; ++k)
      if (std::abs(gaps[k] - gap) < 1e-12 && (out[k].normal - lifted(n)).squaredNorm() < 1e-18)
        return count;
    int slot = count;
    if (count == kMaxContacts) {
      slot = gaps[0] > gaps[1] ? 0 : 1;
      if (gap >= gaps[slot]) return count;
    }
    gaps[slot] = gap;
    out[slot] = {gap, lifted(n)};
    return std::min(count + 1, kMaxContacts);
  }

  Vec3 lifted(const Vec2& n) const { return n.x() * along_ + n.y() * Vec3::UnitZ(); }

  Vec3 along_;
  std::vector<double> x_, z_;
};

}  // namespace hexapod
