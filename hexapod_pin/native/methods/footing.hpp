// Whether feet hold a robot. While they do, errors of its velocity die away; in flight, and where feet
// slide, they stay and add up.
#pragma once

#include <algorithm>

#include "plant/plant.hpp"

namespace hexapod {

constexpr int kFeetThatHold = 3;
constexpr double kSlideSpeed = 3.0;  // of the friction law's speed scale

template <class Contact>
bool slides(const FrictionLaw& law, const Contact& foot) {
  if (law.has_bristle()) return foot.memory.sliding;
  return law.steepness() * in_plane(foot.ground.normal, foot.velocity).norm() > kSlideSpeed;
}

// Whether at least three feet of a robot with joints are in the ground and do not slide.
template <class PlantT>
bool stands(const PlantT& plant) {
  const auto holds = [&plant](const auto& foot) {
    return foot.active && !slides(plant.law.friction, foot);
  };
  return plant.joints() > 0 &&
         std::count_if(plant.feet.begin(), plant.feet.end(), holds) >= kFeetThatHold;
}

}  // namespace hexapod
