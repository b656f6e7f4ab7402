// The right-hand side in a chart and the stiff block, both at one state, to compare them.
#pragma once

#include "plant/settings.hpp"

namespace hexapod {

struct ChartRates {
  VectorXd slope;     // y' of y = (xi, v, z) in the chart of q0
  VectorXd solution;  // x of (I - sJ) x = b with the stiff block there
};

// Under held set-points. In ndf.cpp, where both are instantiated.
ChartRates chart_rates(const PlantSettings& settings, const VectorXd& q0, const VectorXd& y,
                       const VectorXd& q_ref, double s, const VectorXd& b);

}  // namespace hexapod
