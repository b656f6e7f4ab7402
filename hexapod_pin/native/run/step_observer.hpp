// Is called after every step that a method accepts; may end the run. A method that carries its error
// along shows the states that this error would lead to, too.
#pragma once

#include "laws/vectors.hpp"

namespace hexapod {

class StepObserver {
 public:
  virtual ~StepObserver() = default;
  // A step has ended at t in (q, v), where the plant is evaluated; false ends the run.
  virtual bool accepted(double t, const VectorXd& q, const VectorXd& v) = 0;
  // Whether states that are displaced by the run's error are looked at.
  virtual bool looks_at_error() const { return false; }
  virtual bool looks_at_step(double /*t*/) { return false; }  // that ends at t; not at all of them
  virtual bool looks_at_forces() const { return false; }  // of samples
  // (q, v) is the state at t displaced by the run's error: the end of a step that is accepted next, where the
  // plant is evaluated, or a sample that is recorded next, where it is not.
  virtual void displaced_step(double /*t*/, const VectorXd& /*q*/, const VectorXd& /*v*/) {}
  virtual void displaced_sample(double /*t*/, const VectorXd& /*q*/, const VectorXd& /*v*/,
                                double /*error of contact forces, N*/) {}
};

}  // namespace hexapod
