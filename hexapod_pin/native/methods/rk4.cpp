#include "methods/rk4.hpp"

#include "run/fixed_step.hpp"

namespace hexapod {

std::unique_ptr<Rollout> start_rk4(const RunSetup& setup) {
  return start_fixed_step<RungeKutta4>(setup);
}

}  // namespace hexapod
