#include "robust/robust.hpp"

#include <stdexcept>

#include "run/fixed_step.hpp"

namespace hexapod {

namespace {

using Arrow = Plant<ArrowSystem>;

template <bool kFlatFirst>
std::unique_ptr<Rollout> start(const RunSetup& setup) {
  const Tree& tree = setup.plant.dynamics.tree();
  if (tree.joints > 2 && !setup.plant.arrow())
    throw std::invalid_argument(
        "method robust requires legs of three joints on the base");
  return std::make_unique<FixedStepRollout<Arrow, RobustStep<Arrow, kFlatFirst>>>(
      setup.plant.make<ArrowSystem>(), setup);
}

}  // namespace

std::unique_ptr<Rollout> start_robust(const RunSetup& setup) { return start<true>(setup); }
std::unique_ptr<Rollout> start_robust_reference(const RunSetup& setup) { return start<false>(setup); }

}  // namespace hexapod
