// One place where a sphere meets the ground.
#pragma once

#include <array>

#include "laws/vectors.hpp"

namespace hexapod {

constexpr int kMaxContacts = 2;  // of one sphere
constexpr double kFarAway = 1e9;  // gap where there is no contact, m

struct GroundPoint {
  double gap = kFarAway;         // distance of the sphere to the ground, m; negative = penetration
  Vec3 normal = Vec3::UnitZ();   // unit, out of the ground, world axes
};

using GroundPoints = std::array<GroundPoint, kMaxContacts>;

}  // namespace hexapod
