// The fused pass for every processor of the target.
#include "fused/fused_legs_body.hpp"

namespace hexapod::fused {

const Pass kBaselineBuild = run;

}  // namespace hexapod::fused
