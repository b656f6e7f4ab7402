// The fused pass again, compiled with AVX2 and FMA (CMakeLists.txt). No Eigen and no standard
// headers: an inline function that leaks out of this unit would crash older processors.
#include "fused/fused_legs.hpp"

#if defined(__AVX2__) && defined(__FMA__)
#include "fused/fused_legs_body.hpp"
#endif

namespace hexapod::fused {

#if defined(__AVX2__) && defined(__FMA__)
const Pass kAvx2Build = run;
#else
const Pass kAvx2Build = nullptr;
#endif

}  // namespace hexapod::fused
