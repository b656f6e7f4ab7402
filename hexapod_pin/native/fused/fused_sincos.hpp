// Sine and cosine in lanes, to 0.8 ulp: the reduction and the polynomials of fdlibm's e_rem_pio2.c,
// k_sin.c and k_cos.c (Sun Microsystems, 1993), with the reduced angle's low part.
#pragma once

#include "fused/fused_lanes.hpp"

extern "C" double sin(double) noexcept;
extern "C" double cos(double) noexcept;

namespace hexapod::fused {
namespace {

typedef long long Bits __attribute__((vector_size(8 * kWidth)));

struct SinCos {
  Lanes sin, cos;
};

struct Reduced {  // angle = quadrant pi/2 + high + low, |high| <= pi/4
  Lanes high, low;
  Bits quadrant;  // its lowest two bits count
};

// pi/2 in three parts; the first two have 33 bits, so their products with a quadrant are exact.
inline Reduced reduce(Lanes angle) {
  constexpr double kRounder = 6755399441055744.0;  // 1.5 2^52: the sum has no room for fractions
  const Lanes shifted = angle * 6.36619772367581382433e-01 + kRounder;
  const Lanes n = shifted - kRounder;
  const Lanes rest = angle - n * 1.57079632673412561417e+00;
  const Lanes second = n * 6.07710050630396597660e-11;
  const Lanes high = rest - second;
  const Lanes low = ((rest - high) - second) - n * 2.02226624879595063154e-21;
  return {high, low, (Bits)shifted};
}

inline Lanes kernel_sin(Lanes x, Lanes low, Lanes z) {  // z = x^2
  const Lanes r = z * (2.75573137070700676789e-06 +
                       z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10));
  const Lanes p = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + r);
  const Lanes cube = x * z;
  return x - ((z * (0.5 * low - cube * p) - low) + cube * 1.66666666666666324348e-01);
}

inline Lanes kernel_cos(Lanes x, Lanes low, Lanes z) {
  const Lanes r = z * (-2.75573143513906633035e-07 +
                       z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11));
  const Lanes p = z * (4.16666666666666019037e-02 +
                       z * (-1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + r)));
  const Lanes half = 0.5 * z, one = 1.0 - half;
  return one + (((1.0 - one) - half) + (z * p - x * low));
}

inline Lanes choose(Bits mask, Lanes yes, Lanes no) {
  return (Lanes)((mask & (Bits)yes) | (~mask & (Bits)no));
}

inline SinCos sin_cos_small(Lanes angle) {
  const Reduced a = reduce(angle);
  const Lanes z = a.high * a.high;
  const Lanes s = kernel_sin(a.high, a.low, z), c = kernel_cos(a.high, a.low, z);
  const Bits odd = -(a.quadrant & 1);
  return {(Lanes)((Bits)choose(odd, c, s) ^ ((a.quadrant & 2) << 62)),
          (Lanes)((Bits)choose(odd, s, c) ^ (((a.quadrant + 1) & 2) << 62))};
}

__attribute__((noinline)) inline SinCos sin_cos_libm(Lanes angle) {
  SinCos out = {};
  for (int i = 0; i < kWidth; ++i) {
    out.sin[i] = ::sin(angle[i]);
    out.cos[i] = ::cos(angle[i]);
  }
  return out;
}

inline SinCos sin_cos(Lanes angle) {
  constexpr double kExactUpTo = 1e5;  // rad; up to 2^20 quadrants
  bool small = true;
  for (int i = 0; i < kWidth; ++i) small &= __builtin_fabs(angle[i]) < kExactUpTo;
  return __builtin_expect(small, 1) ? sin_cos_small(angle) : sin_cos_libm(angle);
}

}  // namespace
}  // namespace hexapod::fused
