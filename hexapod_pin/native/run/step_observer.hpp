// Is called after every step that a method accepts; may end the run.
#pragma once

#include "laws/vectors.hpp"

namespace hexapod {

class StepObserver {
 public:
  virtual ~StepObserver() = default;
  // A step has ended at t in (q, v), where the plant is evaluated; false ends the run.
  virtual bool accepted(double t, const VectorXd& q, const VectorXd& v) = 0;
};

}  // namespace hexapod
