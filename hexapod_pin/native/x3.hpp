// Extrapolated linearly implicit Euler of order 3: 1, 2 and 3 linear steps across the same interval,
// combined by Aitken and Neville; the difference of the two best is the error. Being made of linearly
// implicit steps it keeps its order with an approximate Jacobian.
#pragma once

#include <algorithm>
#include <array>

#include "flow.hpp"
#include "linear_step.hpp"

namespace hexapod {

template <class PlantT>
class ExtrapolatedEuler {
 public:
  static constexpr int kOrder = 3;  // of the error in the step, for the controller
  static constexpr double kLeastWeight = 0.03;  // s, of velocity errors
  static constexpr bool kTiedToFriction = true;

  explicit ExtrapolatedEuler(const PlantT& plant)
      : linear_(plant), joints_(plant.joints()), book_(plant.feet.size()) {}

  void begin(Flow<PlantT>&, double, const VectorXd&) {}

  // One step h from y0, where the plant has been evaluated (and is kept so); y1 and its error.
  void attempt(Flow<PlantT>& flow, double t, double h, const VectorXd& y0, VectorXd& y1,
               VectorXd& error) {
    for (int n = 0; n < kOrder; ++n) substep(flow, t, h / (n + 1), y0, end_[n]);
    flow.keep();
    for (int n = 1; n < kOrder; ++n)
      for (int k = 1; k <= n; ++k) {
        const double s = h / (n + 1), at = t + k * s;
        mid_ = end_[n];
        flow.evaluate(at, mid_);
        substep(flow, at, s, mid_, end_[n]);
      }
    for (int m = 1; m < kOrder; ++m) {
      if (m == kOrder - 1) error = end_[kOrder - 1];
      for (int n = kOrder - 1; n >= m; --n)
        end_[n] += (end_[n] - end_[n - 1]) / ((n + 1.0) / (n + 1.0 - m) - 1.0);
    }
    y1 = end_[kOrder - 1];
    error -= y1;
  }

 private:
  void substep(Flow<PlantT>& flow, double t, double s, const VectorXd& y, VectorXd& out) {
    PlantT& plant = flow.plant;
    joints_ = flow.joints();
    plant.change_lead(flow.position(), s);
    linear_.begin(plant, flow.reference, t + s);
    linear_.clip_at_start(plant, joints_, flow.velocity());
    linear_.solve(plant, s, joints_, flow.velocity());
    linear_.find_end(plant, s);
    if (&out != &y) out = y;
    flow.v(out) = linear_.v_end();
    xi_ = flow.xi(y);
    chart_rate(xi_, linear_.v_end(), rate_);
    flow.xi(out) += s * rate_;
    for (int i = 0; i < flow.nz / 3; ++i)
      out.template segment<3>(2 * flow.nv + 3 * i) =
          moved_bristle(plant.law.friction, plant.feet[i].ground.normal,
                        linear_.pushes(i) ? linear_.force(i) : Vec3(Vec3::Zero()),
                        flow.bristle(y, i), s);
    book_.clear();
    linear_.keep_book(plant, s, joints_, book_);
    book_.add_to(flow.w(out));
  }

  LinearStep<PlantT> linear_;
  VectorXd joints_, xi_, rate_, mid_;
  Account book_;
  std::array<VectorXd, kOrder> end_;
};

}  // namespace hexapod
