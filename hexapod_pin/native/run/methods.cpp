// The methods by name.
#include <stdexcept>

#include "run/rollout.hpp"

namespace hexapod {

std::unique_ptr<Rollout> start_run(const std::string& method, const RunSetup& setup) {
  if (method == "implicit-euler") return start_implicit_euler(setup);
  if (method == "rk4") return start_rk4(setup);
  if (method == "robust") return start_robust(setup);
  if (method == "robust-reference") return start_robust_reference(setup);
  if (method == "x3") return start_x3(setup);
  if (method == "ndf") return start_ndf(setup);
  if (method == "dop853") return start_dop853(setup);
  throw std::invalid_argument("unknown method " + method);
}

}  // namespace hexapod
