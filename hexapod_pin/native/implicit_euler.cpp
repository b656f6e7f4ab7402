#include "implicit_euler.hpp"

#include "fixed_step.hpp"

namespace hexapod {

std::unique_ptr<Rollout> start_implicit_euler(const RunSetup& setup) {
  return start_fixed_step<ImplicitEuler>(setup);
}

}  // namespace hexapod
