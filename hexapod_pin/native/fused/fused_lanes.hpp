// Numbers, vectors and matrices of as many legs at once as a SIMD register holds. Only for the
// units of the fused pass: what is inline here must stay in the unit that compiled it.
#pragma once

namespace hexapod::fused {
namespace {

#ifdef __AVX2__
constexpr int kWidth = 4;
#else
constexpr int kWidth = 2;
#endif
typedef double Lanes __attribute__((vector_size(8 * kWidth)));

inline Lanes load(const double* from) {
  Lanes x;
  __builtin_memcpy(&x, from, sizeof x);
  return x;
}

inline void store(double* to, Lanes x) { __builtin_memcpy(to, &x, sizeof x); }

inline double sum(Lanes x) {
  double s = x[0];
  for (int i = 1; i < kWidth; ++i) s += x[i];
  return s;
}

// T: double or Lanes
template <class T>
struct Vec {
  T x, y, z;
};

template <class T>
Vec<T> operator+(const Vec<T>& a, const Vec<T>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T, class S>
auto operator*(const Vec<T>& a, const S& s) -> Vec<decltype(a.x * s)> {
  return {a.x * s, a.y * s, a.z * s};
}
template <class T>
T dot(const Vec<T>& a, const Vec<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
Vec<T> cross(const Vec<T>& a, const Vec<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class T>
struct Mat {
  Vec<T> x, y, z;  // columns
};

template <class T, class S>
auto operator*(const Mat<T>& m, const Vec<S>& v) {
  return m.x * v.x + m.y * v.y + m.z * v.z;
}

template <class T>
struct Sym {
  T xx, xy, yy, xz, yz, zz;
};

template <class T>
Vec<T> operator*(const Sym<T>& s, const Vec<T>& v) {
  return {s.xx * v.x + s.xy * v.y + s.xz * v.z, s.xy * v.x + s.yy * v.y + s.yz * v.z,
          s.xz * v.x + s.yz * v.y + s.zz * v.z};
}
template <class T>
Sym<T> operator+(const Sym<T>& s, const Sym<T>& t) {
  return {s.xx + t.xx, s.xy + t.xy, s.yy + t.yy, s.xz + t.xz, s.yz + t.yz, s.zz + t.zz};
}
// h.c 1 - h c^T for parallel h and c
template <class T>
Sym<T> lever_inertia(const Vec<T>& h, const Vec<T>& c) {
  const T x = h.x * c.x, y = h.y * c.y, z = h.z * c.z;
  return {y + z, -h.x * c.y, x + z, -h.x * c.z, -h.y * c.z, x + y};
}
// r s r^T
template <class T>
Sym<T> turned(const Mat<T>& r, const Sym<T>& s) {
  const Vec<T> a = r.x * s.xx + r.y * s.xy + r.z * s.xz;
  const Vec<T> b = r.x * s.xy + r.y * s.yy + r.z * s.yz;
  const Vec<T> c = r.x * s.xz + r.y * s.yz + r.z * s.zz;
  return {a.x * r.x.x + b.x * r.y.x + c.x * r.z.x, a.x * r.x.y + b.x * r.y.y + c.x * r.z.y,
          a.y * r.x.y + b.y * r.y.y + c.y * r.z.y, a.x * r.x.z + b.x * r.y.z + c.x * r.z.z,
          a.y * r.x.z + b.y * r.y.z + c.y * r.z.z, a.z * r.x.z + b.z * r.y.z + c.z * r.z.z};
}

inline Vec<Lanes> load3(const double (*from)[8], int leg) {
  return {load(from[0] + leg), load(from[1] + leg), load(from[2] + leg)};
}
inline Vec<double> load3(const double* from) { return {from[0], from[1], from[2]}; }
inline void store3(double* to, const Vec<double>& v) { to[0] = v.x, to[1] = v.y, to[2] = v.z; }

inline Vec<Lanes> spread(const Vec<double>& v) {
  return {Lanes{} + v.x, Lanes{} + v.y, Lanes{} + v.z};
}
inline Vec<double> sum(const Vec<Lanes>& v) { return {sum(v.x), sum(v.y), sum(v.z)}; }
inline Sym<double> sum(const Sym<Lanes>& s) {
  return {sum(s.xx), sum(s.xy), sum(s.yy), sum(s.xz), sum(s.yz), sum(s.zz)};
}

}  // namespace
}  // namespace hexapod::fused
