// Classical Runge-Kutta of order 4 in the chart of the step's start: explicit, shares no Jacobian.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>

#include "methods/chart_flow.hpp"

namespace hexapod {

template <class PlantT>
class RungeKutta4 {
 public:
  static constexpr bool kForcesAtStepEnd = false;     // contact forces belong to the state itself
  static constexpr bool kNeedsSeparatedFeet = false;  // feet out of contact need no Jacobian

  explicit RungeKutta4(const PlantT& plant) : demand_(plant.joints()) {}

  // One step from the evaluated state; adds the work done during it to the ledger. Limits and stops are
  // as the law has them at every stage; dry friction keeps for the step what it is at its start.
  void step(PlantT& plant, Reference& reference, double t, double h, VectorXd& q, VectorXd& v,
            EnergyLedger& ledger) {
    static constexpr double node[4] = {0.0, 0.5, 0.5, 1.0};
    if (!flow_) flow_.emplace(plant, reference);
    ChartFlow<PlantT>& flow = *flow_;
    flow.begin(q, v, y0_);
    if constexpr (!PlantT::kPrescribed) find_modes(plant, flow, t, h, q, v);
    flow.rate_here(t, y0_, k_[0]);
    for (int s = 1; s < 4; ++s) {
      y_ = y0_ + (node[s] * h) * k_[s - 1];
      flow.rate(t + node[s] * h, y_, k_[s]);
    }
    y_ = y0_ + (h / 6.0) * (k_[0] + 2.0 * k_[1] + 2.0 * k_[2] + k_[3]);
    flow.state(t + h, y_, q, v);
    plant.stop_turned_back(v);
    ledger.add(flow.w(y_));
    flow.update_bristles(y_);
  }

  std::map<std::string, double> counters() const { return {}; }

 private:
  void find_modes(PlantT& plant, ChartFlow<PlantT>& flow, double t, double h, const VectorXd& q,
                  const VectorXd& v) {
    flow.servo_demand(t, demand_);
    plant.find_modes(q, v, demand_);
    const auto switched = [](const DriveMode& mode) { return mode != DriveMode(); };
    if (!plant.drive_counters.idle() || std::any_of(plant.mode.begin(), plant.mode.end(), switched))
      for (int j = 0; j < plant.joints(); ++j)
        plant.drive_counters.add(j, plant.mode[j].limit, plant.mode[j].stop, h);
  }

  std::optional<ChartFlow<PlantT>> flow_;  // of the first step's plant, which stays where it is
  VectorXd y0_, y_, demand_;
  std::array<VectorXd, 4> k_;
};

}  // namespace hexapod
