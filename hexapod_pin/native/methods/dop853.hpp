// DOP853: explicit Runge-Kutta of order 8 with errors of orders 5 and 3 (Hairer, Norsett, Wanner I, II.5).
// Needs no Jacobian and shares none with the implicit methods: an independent reference.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "methods/dop853_table.hpp"
#include "methods/chart_flow.hpp"

namespace hexapod {

template <class PlantT>
class DormandPrince853 {
 public:
  static constexpr double kLeastVelocityWeight = 0.01;  // s, of velocity errors
  static constexpr double kHardVelocityWeight = 0.1;  // s, where a joint is at its torque limit or slides
  static constexpr bool kWeightFollowsFriction = false;
  static constexpr bool kDense = false;  // samples end its steps
  static constexpr bool kSeesEnd = true;
  static constexpr int kMemorySize = 0;

  static double tolerance_share(double) { return 0.3; }  // of the accuracy, for one step

  static double prescribed_share(double) { return 1.0; }  // stability, not accuracy, sets its steps

  explicit DormandPrince853(const PlantT&) {}

  std::vector<double> memory() const { return {}; }
  void restore(const double*) {}

  void begin(ChartFlow<PlantT>& flow, double t, const VectorXd& y0) {
    flow.rate_here(t, y0, k_[0]);
  }

  // One step h from y0, where the plant has been evaluated (that is saved); y1 and its error.
  double attempt(ChartFlow<PlantT>& flow, double t, double h, const VectorXd& y0, const ErrorNorm& norm,
                 VectorXd& y1, VectorXd& error) {
    flow.save_evaluation();
    for (int s = 1; s < kDopStages; ++s) {
      sum(kDopRow[s], s);
      y_ = y0 + h * sum_;
      flow.rate(t + kDopNode[s] * h, y_, k_[s]);
      if (s >= kFirstAccurateStage) flow.inside->passed(t + kDopNode[s] * h, y_);
    }
    sum(kDopWeight, kDopStages);
    y1 = y0 + h * sum_;
    blend_errors(h, error);
    return flow.norm_of(error, norm, h);
  }

  int order() const { return 8; }  // of the error in the step, for the controller

 private:
  static constexpr int kFirstAccurateStage = 4;

  void sum(const double* weight, int count) {
    sum_ = weight[0] * k_[0];
    for (int s = 1; s < count; ++s)
      if (weight[s] != 0.0) sum_ += weight[s] * k_[s];
  }

  // each component as Hairer blends the norms: e5^2 / sqrt(e5^2 + 0.01 e3^2)
  void blend_errors(double h, VectorXd& error) {
    sum(kDopError3, kDopStages);
    const double coarse = sum_.cwiseAbs().maxCoeff();
    sum(kDopError5, kDopStages);
    const double fine = sum_.cwiseAbs().maxCoeff();
    const double share = fine > 0.0 ? fine / std::hypot(fine, 0.1 * coarse) : 0.0;
    error = (h * share) * sum_;
  }

  VectorXd y_, sum_;
  std::array<VectorXd, kDopStages> k_;
};

}  // namespace hexapod
