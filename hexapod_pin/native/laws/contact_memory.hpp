// What a contact remembers between steps; the laws themselves are pure.
#pragma once

#include <limits>

#include "laws/ground.hpp"
#include "laws/vectors.hpp"

namespace hexapod {

constexpr int kNoPatch = -2;     // of a foot that has not come from one to another
constexpr int kUnseenPatch = -3;  // of a foot whose place has not been seen

struct ContactMemory {
  double touch_speed = 0.0;     // approach speed before first touch, m/s
  Vec3 stretch = Vec3::Zero();  // of the bristle, in the ground plane, m
  bool touching = false;
  bool sliding = false;  // the bristle ended the last step on the cone
  bool released = false;  // the damper would pull, the normal force is 0; where that is frozen within a step
  Vec3 face = Vec3::Zero();  // normal of the face of the ground it stands on; 0: none, or not known
  double face_gap = 0.0;     // to that face, m
  int patch = -1;        // of the ground it stands on, where that is frozen within a step; -1: none
  int left = kUnseenPatch;  // the one it has come from, likewise
  // Height of the last accepted state out of the ground, m; found again at any state out of it.
  double free_gap = std::numeric_limits<double>::infinity();

  void stand_on(const GroundPoint& ground) {
    touching = true;
    face = ground.normal, face_gap = ground.gap;
  }

  // After separation; the touch speed is that of the last touch until the foot is seen free again.
  void reset() { *this = ContactMemory{touch_speed, Vec3::Zero(), false, false, false, Vec3::Zero(), 0.0, patch, kUnseenPatch, free_gap}; }
};

}  // namespace hexapod
