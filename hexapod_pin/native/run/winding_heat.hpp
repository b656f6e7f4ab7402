// Currents of the motors, and the temperatures of their windings, along a run: two thermal bodies for each, a
// resistance that grows with the winding's temperature, and magnets that weaken with the housing's:
//   i = torque / (k (1 - b (T_h - 25)))
//   C_w T_w' = i^2 R (1 + c (T_w - 25)) - (T_w - T_h) / R_wh,   C_h T_h' = (T_w - T_h) / R_wh - (T_h - T_a) / R_ha
// with C = time constant / resistance. Between two states i^2 is its mean, and the implicit midpoint rule is taken.
#pragma once

#include <cmath>

#include "laws/vectors.hpp"

namespace hexapod {

class WindingHeat {
 public:
  // A row per joint: A/(N m) of the joint, ohm at 25 deg C, K/W to the housing, K/W on to the surroundings, time
  // constants of winding and housing [s], temperature of the surroundings [deg C]; NaN: not known. No rows:
  // nothing is followed.
  static constexpr Eigen::Index kColumns = 7;

  explicit WindingHeat(const RowMatrix& motors)
      : motors_(motors), current_(VectorXd::Zero(motors.rows())), winding_(current_), housing_(current_) {
    if (any()) winding_ = housing_ = motors_.col(6);
    for (Eigen::Index j = 0; j < motors_.rows(); ++j)
      if (!motors_.row(j).allFinite()) winding_[j] = std::nan("");
  }

  bool any() const { return motors_.rows() > 0; }
  const VectorXd& current() const { return current_; }      // A
  const VectorXd& temperature() const { return winding_; }  // deg C

  // Motor torques [N m] at a time that is not before the last.
  void see(double t, const VectorXd& torque) {
    const double step = t - time_;
    for (Eigen::Index j = 0; j < motors_.rows(); ++j) {
      const double before = current_[j], now = motors_(j, 0) * torque[j] / flux(j);
      if (step > 0.0) warm(j, step, 0.5 * (before * before + now * now));  // not at the start: it is NaN
      current_[j] = now;
    }
    if (!(step <= 0.0)) time_ = t;
  }

 private:
  static constexpr double kCopper = 0.0039, kMagnet = 0.0011, kReference = 25.0;  // 1/K, 1/K, deg C

  // Torque constant over that at 25 deg C, at the housing's temperature so far: it changes over minutes.
  double flux(Eigen::Index j) const {
    return std::isnan(winding_[j]) ? 1.0 : 1.0 - kMagnet * (housing_[j] - kReference);
  }

  void warm(Eigen::Index j, double step, double square) {
    const double to_housing = motors_(j, 2), to_ambient = motors_(j, 3);
    const double winding = motors_(j, 4) / to_housing, housing = motors_(j, 5) / to_ambient;  // J/K
    const double loss = square * motors_(j, 1);
    const double a = (kCopper * loss - 1.0 / to_housing) / winding, b = 1.0 / (to_housing * winding);
    const double c = 1.0 / (to_housing * housing), d = -(1.0 / to_housing + 1.0 / to_ambient) / housing;
    const double p = step * (a * winding_[j] + b * housing_[j] + loss * (1.0 - kCopper * kReference) / winding);
    const double q = step * (c * winding_[j] + d * housing_[j] + motors_(j, 6) / (to_ambient * housing));
    const double h = 0.5 * step, one = 1.0 - h * a, two = 1.0 - h * d, det = one * two - h * h * b * c;
    winding_[j] += (two * p + h * b * q) / det;
    housing_[j] += (one * q + h * c * p) / det;
  }

  RowMatrix motors_;
  VectorXd current_, winding_, housing_;
  double time_ = std::nan("");
};

}  // namespace hexapod
