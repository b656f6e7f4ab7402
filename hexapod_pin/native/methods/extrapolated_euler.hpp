// Extrapolated linearly implicit Euler: 1, 2 and 3 linear steps across the same interval, combined by
// Aitken and Neville to order 3; the difference of the two best is the error. Being made of linearly
// implicit steps it keeps its order with an approximate Jacobian. Between its ends a step is a cubic, whose
// slopes there are differences of the rows' substeps, extrapolated as the rows' ends are (Hairer & Ostermann,
// Dense output for extrapolation methods, 1990; Hairer & Wanner II, IV.9). Slopes by the right-hand side
// would multiply errors of velocity by the step times the rate at which contacts damp, which is far above 1.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "methods/error_control.hpp"
#include "methods/chart_flow.hpp"
#include "methods/linear_step.hpp"
#include "plant/chart.hpp"

namespace hexapod {

template <class PlantT>
class ExtrapolatedEuler {
 public:
  static constexpr double kLeastVelocityWeight = 0.03;  // s, of velocity errors
  static constexpr double kHardVelocityWeight = 0.1;  // s, where a joint is at its torque limit or slides
  static constexpr bool kWeightFollowsFriction = true;
  static constexpr bool kDense = true;  // states within a step are known
  static constexpr bool kSeesEnd = false;  // the last state looked at is at two thirds of a step

  // Share of the accuracy that one step may lose. Errors accumulate to about twice the largest of them;
  // from 1e-4 m on the velocity weight of the friction law, not the accuracy, sets most steps.
  static double tolerance_share(double accuracy) {
    return std::clamp(std::pow(accuracy / 1e-4, 0.4), 0.4, 1.0);
  }

  // Further share where joints follow a motion: no servo gives way to an error on a stiff foot. With it
  // errors are those of servo runs (docs/results/prescribed_cost.md).
  static double prescribed_share(double accuracy) {
    return std::clamp(0.15 * std::pow(1e-4 / accuracy, 0.3), 0.075, 0.3);
  }

  explicit ExtrapolatedEuler(const PlantT& plant)
      : linear_(plant), joints_(plant.joints()), works_(plant.feet.size()) {}

  void begin(ChartFlow<PlantT>&, double, const VectorXd&) {}

  // One step h from y0, where the plant has been evaluated (that is saved): y1, its error, and the
  // error's size in tolerances. Order 2 is accepted where it is accurate enough, and the third row is
  // not begun where order 2 is far worse than in the steps accepted so far.
  double attempt(ChartFlow<PlantT>& flow, double t, double h, const VectorXd& y0, const ErrorNorm& norm,
                 VectorXd& y1, VectorXd& error) {
    fitted_ = false;
    for (int n = 1; n <= 3; ++n) substep(flow, t, h / n, y0, end_[n - 1]);
    flow.save_evaluation();
    finish_row(flow, t, h, 2);
    y1 = 2.0 * end_[1] - end_[0];
    error = y1 - end_[1];
    order_ = 2;
    const double coarse = flow.norm_of(error, norm, h);
    if (coarse <= kAcceptedAtOrder2) return update_statistics(coarse, h, coarse);
    order_ = 3;
    const double grown = last_step_ > 0.0 ? last_coarse_ * std::pow(h / last_step_, 2) : 0.0;
    const double expected = std::max({1.0, typical_coarse_, grown});
    if (!(coarse <= kRejectedAtOrder2 * expected)) return std::pow(coarse / expected, 1.5);
    finish_row(flow, t, h, 3);
    last_ = 3.0 * end_[2] - 2.0 * end_[1];
    error = 0.5 * (last_ - y1);
    y1 = last_ + error;
    return update_statistics(flow.norm_of(error, norm, h), h, coarse);
  }

  // The state at a share x of the last step, which has led from y0 to y1.
  void interpolate(double x, const VectorXd& y0, const VectorXd& y1, VectorXd& y) {
    if (!fitted_) fit(y0, y1);
    const double s = x - 1.0;
    y = y1 + s * (end_slope_ + s * (curve_ + s * bend_));
  }

  // What the size of the next steps depends on, for a checkpoint.
  std::vector<double> memory() const { return {typical_coarse_, last_coarse_, last_step_}; }
  void restore(const double* memory) {
    typical_coarse_ = memory[0], last_coarse_ = memory[1], last_step_ = memory[2];
  }
  static constexpr int kMemorySize = 3;

  int order() const { return order_; }  // of the error last given, for the controller

 private:
  static constexpr double kAcceptedAtOrder2 = 0.8;   // tolerances
  static constexpr double kRejectedAtOrder2 = 15.0;  // times the expected error

  double update_statistics(double size, double h, double coarse) {
    if (!(size <= 1.0)) return size;
    typical_coarse_ += 0.1 * (coarse - typical_coarse_);
    last_coarse_ = coarse;
    last_step_ = h;
    return size;
  }

  // The second to nth of n linear steps.
  void finish_row(ChartFlow<PlantT>& flow, double t, double h, int n) {
    const double s = h / n;
    for (int k = 1; k < n; ++k) {
      VectorXd& passed = inside_[n + k - 3];
      passed.swap(end_[n - 1]);
      flow.evaluate(t + k * s, passed);
      flow.inside->passed(t + k * s, passed);
      substep(flow, t + k * s, s, passed, end_[n - 1]);
    }
  }

  // The cubic through y0 and y1 with a slope at each end, in powers of s = x - 1. The slope at the start is
  // extrapolated from the rows' first substeps, of which there are three at either order, that at the end
  // from the last substeps of the rows that y1 is made of.
  void fit(const VectorXd& y0, const VectorXd& y1) {
    const auto& [half, third, two_thirds] = inside_;
    start_slope_ = 0.5 * end_[0] - 8.0 * half + 13.5 * (order_ == 2 ? end_[2] : third) - 6.0 * y0;
    if (order_ == 2) end_slope_ = 4.0 * (end_[1] - half) - (end_[0] - y0);
    else end_slope_ = 0.5 * (end_[0] - y0) - 8.0 * (end_[1] - half) + 13.5 * (end_[2] - two_thirds);
    curve_ = 2.0 * end_slope_ + start_slope_ - 3.0 * (y1 - y0);
    bend_ = end_slope_ + start_slope_ - 2.0 * (y1 - y0);
    fitted_ = true;
  }

  void substep(ChartFlow<PlantT>& flow, double t, double s, const VectorXd& y, VectorXd& out) {
    PlantT& plant = flow.plant;
    joints_ = flow.joints();
    plant.set_implicit_dt(flow.position(), s);
    linear_.begin_frozen(plant, flow.reference, t + s);
    linear_.solve(plant, s, joints_, flow.velocity());
    linear_.find_end(plant, s);
    if (&out != &y) out = y;
    flow.put_velocity(linear_.v_end(), out);
    xi_ = flow.xi(y);
    chart_rate(xi_, linear_.v_end(), rate_);
    xi_ += s * rate_;
    flow.put_chart(xi_, out);
    for (int i = 0; i < flow.nz / 3; ++i)
      out.template segment<3>(2 * flow.nv + 3 * i) =
          next_stretch(plant.law.friction, plant.feet[i].ground.normal,
                        linear_.has_force(i) ? linear_.force(i) : Vec3(Vec3::Zero()),
                        flow.bristle(y, i), s);
    works_.clear();
    linear_.accumulate(plant, s, joints_, works_);
    works_.add_to(flow.w(out));
  }

  LinearStep<PlantT> linear_;
  VectorXd joints_, xi_, rate_, last_;
  EnergyLedger works_;  // of one substep
  std::array<VectorXd, 3> end_;  // of each row
  std::array<VectorXd, 3> inside_;  // of rows 2 and 3: at 1/2, 1/3 and 2/3 of the step
  VectorXd start_slope_, end_slope_, curve_, bend_;  // of the cubic across the step, if it is fitted
  bool fitted_ = false;
  double typical_coarse_ = 10.0;          // order-2 error of accepted steps, tolerances
  double last_coarse_ = 0.0, last_step_ = 0.0;  // of the last one, tolerances and s
  int order_ = 3;
};

}  // namespace hexapod
