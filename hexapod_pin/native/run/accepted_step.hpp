// Told of every step that a method accepts.
#pragma once

#include "laws/vectors.hpp"

namespace hexapod {

class AcceptedStep {
 public:
  virtual ~AcceptedStep() = default;
  // A step has ended at t in (q, v), where the plant is evaluated.
  virtual void accepted(double t, const VectorXd& q, const VectorXd& v) = 0;
};

}  // namespace hexapod
