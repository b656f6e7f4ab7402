// Everything a plant is made of, as the bindings get it from Python.
#pragma once

#include <vector>

#include "plant/arrow.hpp"
#include "plant/dense.hpp"
#include "plant/plant.hpp"
#include "plant/prescribed_system.hpp"

namespace hexapod {

struct PlantSettings {
  Dynamics dynamics;
  std::vector<FootMount> mounts;
  ContactLaw law;
  Terrain terrain;
  DriveLaw drive;
  Loads loads;
  bool dense = false;
  bool prescribed = false;  // joints follow their set-points exactly

  bool arrow() const { return !dense && dynamics.tree().has_three_joint_legs(); }
  template <class System>
  Plant<System> make() const {
    Plant<System> plant(dynamics, mounts, law, terrain, drive);
    plant.loads = loads;
    return plant;
  }

  // use(plant) with the plant of the linear system that fits the tree.
  template <class Use>
  auto with_plant(Use&& use) const {
    if (prescribed) return use(make<PrescribedSystem>());
    return arrow() ? use(make<ArrowSystem>()) : use(make<DenseSystem>());
  }
};

}  // namespace hexapod
