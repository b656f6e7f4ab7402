#include "methods/x3.hpp"

#include "methods/one_step_driver.hpp"
#include "run/adaptive.hpp"

namespace hexapod {

template <class PlantT>
using X3Driver = OneStepDriver<PlantT, ExtrapolatedEuler>;

std::unique_ptr<Rollout> start_x3(const RunSetup& setup) { return start_adaptive<X3Driver>(setup); }

}  // namespace hexapod
