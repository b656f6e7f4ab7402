#include "methods/extrapolated_euler.hpp"

#include "methods/one_step_driver.hpp"
#include "run/adaptive.hpp"

namespace hexapod {

template <class PlantT>
using ExtrapolatedEulerDriver = OneStepDriver<PlantT, ExtrapolatedEuler>;

std::unique_ptr<Rollout> start_extrapolated_euler(const RunSetup& setup) {
  return start_adaptive<ExtrapolatedEulerDriver>(setup);
}

}  // namespace hexapod
