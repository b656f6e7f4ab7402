// Which of a foot's two contacts is which: a face of the ground keeps its place, and with it its memory,
// while other faces come near and go.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "laws/ground.hpp"

namespace hexapod {

// The first place is that of the more level face, the second that of the steeper one: a face has the
// same place with and without the other, seen from above the ground and from below it.
inline void put_treads_first(GroundPoints& points) {
  constexpr double kSteep = 0.5;  // of a normal, upwards
  const bool single = points[1].gap == kFarAway;
  const double other = single ? kSteep : points[1].normal.z();
  if (points[0].normal.z() < other) std::swap(points[0], points[1]);
}

// A contact that goes on keeps its place when the faces change. Contacts are known by the faces that they
// remember: those of the last accepted state, whatever states a method has looked at since.
template <class Contact>
void keep_order(const Contact& first, const Contact& second, GroundPoints& points) {
  constexpr double kGapsApart = 0.1;  // m, of parallel faces, that count as much as normals across
  const auto similarity = [](const Contact& old, const GroundPoint& point) {
    if (!old.memory.touching || point.gap == kFarAway) return -1.0;
    const double apart = std::abs(point.gap - old.memory.face_gap) / kGapsApart;
    return old.memory.face.dot(point.normal) - std::min(apart, 1.0);
  };
  const double kept = similarity(first, points[0]) + similarity(second, points[1]);
  const double swapped = similarity(first, points[1]) + similarity(second, points[0]);
  if (swapped > kept) std::swap(points[0], points[1]);
}

}  // namespace hexapod
