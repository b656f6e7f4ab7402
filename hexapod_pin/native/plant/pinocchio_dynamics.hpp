// The tree's dynamics by Pinocchio, for every shape of tree. Pinocchio stays behind this wall: only
// pinocchio_dynamics.cpp includes it, and takes its algorithms from the library as they were compiled.
#pragma once

#include <memory>
#include <vector>

#include "plant/tree.hpp"

namespace hexapod {

class PinocchioDynamics {
 public:
  PinocchioDynamics(const TreeModel& model, const Vec3& gravity);
  PinocchioDynamics(const PinocchioDynamics& other);
  PinocchioDynamics& operator=(const PinocchioDynamics&) = delete;
  ~PinocchioDynamics();

  // As `Dynamics::compute`, into these places.
  void compute(const VectorXd& q, const VectorXd& v, Eigen::MatrixXd& mass_upper, VectorXd& bias,
               Mat3& base_rotation, std::vector<Vec3>& axis, std::vector<Vec3>& origin);

  Vec3 point(std::size_t joint, const Vec3& offset) const;
  Vec3 center_of_mass() const;

  // crba and nonLinearEffects and nothing else, `count` times, for benchmarks
  double repeat(const VectorXd& q, const VectorXd& v, long count) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::vector<char> turns_;  // of each joint; else it slides
};

}  // namespace hexapod
