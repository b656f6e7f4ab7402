#include "methods/ndf.hpp"

#include <stdexcept>

#include "methods/chart_rates.hpp"
#include "run/adaptive.hpp"

namespace hexapod {

std::unique_ptr<Rollout> start_ndf(const RunSetup& setup) { return start_adaptive<NdfDriver>(setup); }

namespace {

template <class PlantT>
ChartRates rates_in_chart(PlantT plant, const VectorXd& q0, const VectorXd& y,
                          const VectorXd& q_ref, double s, const VectorXd& b) {
  Reference reference({0.0}, q_ref.transpose(), RowMatrix::Zero(1, q_ref.size()),
                      Interpolation::held);
  ChartFlow<PlantT> flow(plant, reference);
  ChartRates out;
  const int free = flow.size() - flow.nw;
  if (y.size() != free || b.size() != free) throw std::invalid_argument("y and b must have one entry per unknown");
  flow.begin(q0, y.segment(flow.nv, flow.nv), out.slope);
  VectorXd full = VectorXd::Zero(flow.size());
  full.head(free) = y;
  flow.evaluate(0.0, full);
  VectorXd demand(plant.joints());
  flow.servo_demand(0.0, demand);
  plant.find_modes(flow.position(), flow.velocity(), demand);
  flow.rate_here(0.0, full, out.slope);
  out.slope.conservativeResize(free);
  StiffBlock<PlantT> block(plant);
  block.capture(plant, flow.xi(full));
  block.factor(plant, s);
  full.head(free) = b;
  block.solve(flow.xi(full), flow.v(full), flow.z(full));
  out.solution = full.head(free);
  return out;
}

}  // namespace

ChartRates chart_rates(const PlantSettings& settings, const VectorXd& q0, const VectorXd& y,
                       const VectorXd& q_ref, double s, const VectorXd& b) {
  return settings.with_plant(
      [&](auto plant) { return rates_in_chart(std::move(plant), q0, y, q_ref, s, b); });
}

}  // namespace hexapod
