#include "robust/robust.hpp"

#include <stdexcept>

#include "run/fixed_step.hpp"

namespace hexapod {

namespace {

template <class System, bool kFlatFirst>
std::unique_ptr<Rollout> start_with(const RunSetup& setup) {
  using PlantT = Plant<System>;
  return start_run_of<FixedStepRollout<PlantT, RobustStep<PlantT, kFlatFirst>>>(
      setup.plant.make<System>(), setup);
}

template <bool kFlatFirst>
std::unique_ptr<Rollout> start(const RunSetup& setup) {
  if (setup.plant.prescribed) {
    if constexpr (kFlatFirst) return start_with<PrescribedSystem, true>(setup);
    else throw std::invalid_argument("method robust-reference is for joints that are driven");
  }
  const Tree& tree = setup.plant.dynamics.tree();
  if (tree.joints > 2 && !setup.plant.arrow())
    throw std::invalid_argument(
        "method robust requires legs of three joints on the base");
  return start_with<ArrowSystem, kFlatFirst>(setup);
}

}  // namespace

std::unique_ptr<Rollout> start_robust(const RunSetup& setup) { return start<true>(setup); }
std::unique_ptr<Rollout> start_robust_reference(const RunSetup& setup) { return start<false>(setup); }

}  // namespace hexapod
