// The largest magnitudes seen, with their signs and times.
#pragma once

#include <cmath>

#include "laws/vectors.hpp"

namespace hexapod {

using Eigen::ArrayXd;

struct Peak {
  double size = -1.0, value = 0.0, time = 0.0;  // |value|; < 0: nothing seen

  bool see(double x, double t) {  // whether it is larger than all before
    const double magnitude = std::abs(x);
    if (!(magnitude > size)) return false;
    size = magnitude, value = x, time = t;
    return true;
  }
  void see(const Peak& other) {
    if (other.size > size) *this = other;
  }
};

// A peak per joint or foot.
struct Peaks {
  explicit Peaks(Eigen::Index count) { clear(count); }
  void clear(Eigen::Index count) {
    size.setConstant(count, -1.0), value.setZero(count), time.setZero(count);
  }

  void see(const ArrayXd& x, double t) {
    if (x.size() == 0 || (x.abs() - size).maxCoeff() <= 0.0) return;
    for (Eigen::Index k = 0; k < x.size(); ++k) see(k, x[k], t);
  }
  void see(Eigen::Index k, double x, double t) {
    const double magnitude = std::abs(x);
    if (magnitude > size[k]) size[k] = magnitude, value[k] = x, time[k] = t;
  }
  void see(const Peaks& other) {
    for (Eigen::Index k = 0; k < size.size(); ++k)
      if (other.size[k] > size[k]) see(k, other.value[k], other.time[k]);
  }
  void set(Eigen::Index k, const Peak& peak) {
    size[k] = peak.size, value[k] = peak.value, time[k] = peak.time;
  }
  void take(Peaks& other) {  // and empties it
    see(other);
    other.clear(size.size());
  }

  ArrayXd size, value, time;  // |value|, < 0 where nothing was seen
};

}  // namespace hexapod
