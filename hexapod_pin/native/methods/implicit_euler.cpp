#include "methods/implicit_euler.hpp"

#include "run/fixed_step.hpp"

namespace hexapod {

std::unique_ptr<Rollout> start_implicit_euler(const RunSetup& setup) {
  return start_fixed_step<ImplicitEuler>(setup);
}

}  // namespace hexapod
