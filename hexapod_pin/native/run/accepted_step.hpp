// Told of every step that a method accepts.
#pragma once

#include "laws/vectors.hpp"

namespace hexapod {

class AcceptedStep {
 public:
  virtual ~AcceptedStep() = default;
  // A step of dt [s] has ended at t in (q, v), where the plant is evaluated.
  virtual void accepted(double t, double dt, const VectorXd& q, const VectorXd& v) = 0;
};

}  // namespace hexapod
