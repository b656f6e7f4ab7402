// Everything a plant is made of, as it comes over the border from Python.
#pragma once

#include <vector>

#include "plant/arrow.hpp"
#include "plant/dense.hpp"
#include "plant/plant.hpp"

namespace hexapod {

struct PlantSettings {
  Dynamics dynamics;
  std::vector<FootMount> mounts;
  ContactLaw law;
  Terrain terrain;
  Servo servo;
  JointStops stops;
  bool dense = false;

  bool arrow() const { return !dense && dynamics.tree().has_three_joint_legs(); }
  template <class System>
  Plant<System> make() const {
    return {dynamics, mounts, law, terrain, servo, stops};
  }
};

}  // namespace hexapod
