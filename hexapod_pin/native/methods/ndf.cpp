#include "methods/ndf.hpp"

#include "run/adaptive.hpp"

namespace hexapod {

std::unique_ptr<Rollout> start_ndf(const RunSetup& setup) { return start_adaptive<NdfDriver>(setup); }

namespace {

template <class PlantT>
ChartRates rates_in_chart(PlantT plant, const VectorXd& q0, const VectorXd& y,
                          const VectorXd& q_ref, double s, const VectorXd& b) {
  Reference reference({0.0}, q_ref.transpose(), RowMatrix::Zero(1, q_ref.size()), true);
  Flow<PlantT> flow(plant, reference);
  ChartRates out;
  const int free = flow.size() - flow.nw;
  if (y.size() != free || b.size() != free) throw std::invalid_argument("y or b of the wrong size");
  flow.begin(q0, y.segment(flow.nv, flow.nv), out.slope);
  VectorXd whole = VectorXd::Zero(flow.size());
  whole.head(free) = y;
  flow.rate(0.0, whole, out.slope);
  out.slope.conservativeResize(free);
  const Servo& servo = plant.servo;
  const VectorXd wanted = servo.kp.cwiseProduct(q_ref - flow.joints()) -
                          servo.kd.cwiseProduct(flow.velocity().tail(plant.joints()));
  StiffBlock<PlantT> block(plant);
  block.capture(plant, flow.xi(whole), wanted);
  block.factor(plant, s);
  whole.head(free) = b;
  block.solve(flow.xi(whole), flow.v(whole), flow.z(whole));
  out.solution = whole.head(free);
  return out;
}

}  // namespace

ChartRates chart_rates(const PlantSettings& settings, const VectorXd& q0, const VectorXd& y,
                       const VectorXd& q_ref, double s, const VectorXd& b) {
  return settings.arrow() ? rates_in_chart(settings.make<ArrowSystem>(), q0, y, q_ref, s, b)
                          : rates_in_chart(settings.make<DenseSystem>(), q0, y, q_ref, s, b);
}

}  // namespace hexapod
