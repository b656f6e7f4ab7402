// Bodies of the fused pass: their motion, inertia and load, about one common point.
#pragma once

#include "fused/fused_lanes.hpp"

namespace hexapod::fused {
namespace {

template <class T>
struct Motion {  // velocity and bias acceleration at the base's origin
  Vec<T> v, w, a, alpha;
};

template <class T>
struct Inertia {
  T mass;
  Vec<T> first;   // m c
  Sym<T> second;  // about the base's origin
};

template <class T>
struct Load {
  Vec<T> force, moment;
};

template <class T>
void add(Inertia<T>& to, const Inertia<T>& y) {
  to.mass = to.mass + y.mass;
  to.first = to.first + y.first;
  to.second = to.second + y.second;
}

template <class T>
void add(Load<T>& to, const Load<T>& f) {
  to.force = to.force + f.force;
  to.moment = to.moment + f.moment;
}

// linear and angular momentum of a twist
template <class T>
Load<T> momentum(const Inertia<T>& y, const Vec<T>& v, const Vec<T>& w) {
  return {v * y.mass + cross(w, y.first), y.second * w + cross(y.first, v)};
}

// f = Y a + v x* Y v
template <class T>
Load<T> load_of(const Inertia<T>& y, const Motion<T>& m) {
  const Load<T> p = momentum(y, m.v, m.w), rate = momentum(y, m.a, m.alpha);
  return {rate.force + cross(m.w, p.force),
          rate.moment + cross(m.w, p.moment) + cross(m.v, p.force)};
}

}  // namespace
}  // namespace hexapod::fused
