// The ground under a sphere: its gaps and normals. Depth is measured along the normal.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "laws/ground.hpp"
#include "laws/height_field.hpp"
#include "laws/profile.hpp"

namespace hexapod {

struct Plane {
  Vec3 point = Vec3::Zero(), normal = Vec3::UnitZ();

  int find_contacts(const Vec3& center, double radius, GroundPoints& out) const {
    out[0] = {normal.dot(center - point) - radius, normal};
    return 1;
  }
};

struct Patch {  // a rectangle of another ground, world axes
  double x0, y0, x1, y1;
  double friction = 1.0, stiffness = 1.0;  // factors on mu and K

  // How far a place is inside, along the axes, m; negative outside.
  double depth(double x, double y) const {
    return std::min(std::min(x - x0, x1 - x), std::min(y - y0, y1 - y));
  }
};

// A foot that has crossed an edge is back where it came from when it is so far beyond it, m: where the ground
// on either side drives it to the other, it switches at the pace of this way and not without end.
constexpr double kEdgeWidth = 1e-5;

struct Terrain {
  std::variant<Plane, Profile, HeightField> shape;
  std::vector<Patch> patches;
  double amplitude = 0.0, rate = 0.0;  // vertical shaking A sin(rate t), m and rad/s

  // Contacts a sphere can have at once.
  int max_contacts() const { return std::holds_alternative<Profile>(shape) ? 2 : 1; }

  // Height [m] and vertical speed [m/s] of the shaken ground.
  double surface_height(double t) const {
    return amplitude == 0.0 ? 0.0 : amplitude * std::sin(rate * t);
  }
  double surface_speed(double t) const {
    return amplitude == 0.0 ? 0.0 : amplitude * rate * std::cos(rate * t);
  }

  // Fills `out` and returns how many; the others stay as they are (far away).
  int find_contacts(const Vec3& center, double radius, double t, GroundPoints& out) const {
    const Vec3 seen(center.x(), center.y(), center.z() - surface_height(t));
    return std::visit([&](const auto& s) { return s.find_contacts(seen, radius, out); }, shape);
  }

  // Index of the patch at a place, the first that covers it; -1: none.
  int patch_at(double x, double y) const {
    for (std::size_t k = 0; k < patches.size(); ++k)
      if (patches[k].depth(x, y) >= 0.0) return int(k);
    return -1;
  }

  // The same of a foot that stands on a patch and has come from another, by their indices.
  int patch_after(int from, int left, double x, double y) const {
    const int now = patch_at(x, y);
    if (now != left || now == from) return now;
    return signed_depth(from, now, x, y) < -kEdgeWidth ? now : from;
  }

  // Depth in the patch that decides between two of them, the first in the list; above zero on the side of
  // `from`, m.
  double signed_depth(int from, int to, double x, double y) const {
    const bool leaves = to < 0 || (from >= 0 && from < to);
    const double depth = patches[std::size_t(leaves ? from : to)].depth(x, y);
    return leaves ? depth : -depth;
  }

  std::pair<double, double> patch_factors(int patch) const {  // friction, stiffness
    if (patch < 0) return {1.0, 1.0};
    return {patches[std::size_t(patch)].friction, patches[std::size_t(patch)].stiffness};
  }
  std::pair<double, double> patch_factors(double x, double y) const {
    return patch_factors(patch_at(x, y));
  }
};

}  // namespace hexapod
