// Inverse kinematics of a leg of any shape, of two or three joints: Newton steps to every target of a path,
// and a search where they lead away. Angles in rad, lengths in m, base frame.
#pragma once

#include "kinematics/revolute_chain.hpp"
#include "laws/vectors.hpp"

namespace hexapod {

struct FoundAngles {
  RowMatrix q;              // a row of joint angles per target
  Eigen::Index missed = -1;  // the first target that nothing reaches: `q` is not to be used
  double distance = 0.0;    // of the nearest foot found from that target, m
};

template <int J>
class LegSearch {
 public:
  static constexpr int kJoints = J;
  using Angles = Eigen::Matrix<double, J, 1>;
  using Task = Eigen::Matrix<double, J, 3>;
  using Targets = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

  // `task`: directions along which the foot follows its targets; `tolerance`: a foot this near has
  // reached its target, m.
  LegSearch(const RevoluteChain<J>& chain, const Task& task, const Angles& lower, const Angles& upper,
            double tolerance)
      : chain_(chain), task_(task), lower_(lower), upper_(upper), tolerance_(tolerance) {}

  // Angles of targets along a path: the first near a reference, each other one near the one before.
  // `limited`: what is searched stays inside the joint limits.
  FoundAngles follow(const Targets& targets, const Angles& near, bool limited) const;

  // Angles of unrelated targets, each near a reference of its own, a row of `near`.
  FoundAngles each(const Targets& targets, const RowMatrix& near, bool limited) const;

  // How far the foot stays away from each target, joint limits aside, by a search from a reference.
  VectorXd distances(const Targets& targets, const Angles& near) const;

 private:
  Angles missed(const Vec3& target, const Angles& q) const;
  Angles newton(const Vec3& target, Angles q) const;
  double search(const Vec3& target, Angles& q, bool limited) const;
  double solve(const Vec3& target, Angles& q, bool limited) const;

  RevoluteChain<J> chain_;
  Task task_;
  Angles lower_, upper_;
  double tolerance_;  // m
};

}  // namespace hexapod
