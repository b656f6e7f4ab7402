// The methods by name.
#include <array>
#include <stdexcept>

#include "run/rollout.hpp"

namespace hexapod {

namespace {

struct NamedMethod {
  const char* name;
  std::unique_ptr<Rollout> (*start)(const RunSetup& setup);
};

constexpr std::array<NamedMethod, 7> kMethods = {{
    {"implicit-euler", start_implicit_euler},
    {"rk4", start_rk4},
    {"robust", start_robust},
    {"robust-reference", start_robust_reference},
    {"extrapolated-euler", start_extrapolated_euler},
    {"ndf", start_ndf},
    {"dop853", start_dop853},
}};

}  // namespace

std::unique_ptr<Rollout> start_run(const std::string& method, const RunSetup& setup) {
  for (const NamedMethod& entry : kMethods)
    if (method == entry.name) return entry.start(setup);
  throw std::invalid_argument("unknown method " + method);
}

}  // namespace hexapod
