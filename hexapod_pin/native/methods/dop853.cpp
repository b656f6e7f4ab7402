#include "methods/dop853.hpp"

#include "methods/one_step_driver.hpp"
#include "run/adaptive.hpp"

namespace hexapod {

template <class PlantT>
using Dop853Driver = OneStepDriver<PlantT, DormandPrince853>;

std::unique_ptr<Rollout> start_dop853(const RunSetup& setup) {
  return start_adaptive<Dop853Driver>(setup);
}

}  // namespace hexapod
