// What else acts on a robot: pushes that begin and end, and joints whose drives fail.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "laws/vectors.hpp"
#include "plant/dynamics.hpp"

namespace hexapod {

// A wrench on a point of a body, constant in world axes between two times.
struct Push {
  std::size_t joint;   // that the body follows; 1 = the floating base
  Vec3 offset;         // of the point in the joint's frame, m
  Vec3 force, torque;  // N, N m
  double start, end;   // s
};

// A joint whose drive gives no torque from a time on.
struct LostDrive {
  int joint;    // as in the joint angles
  double time;  // s
};

struct Loads {
  std::vector<Push> pushes;
  std::vector<LostDrive> lost;

  // Whether what begins at `start` has begun at t; times within rounding are the same.
  static bool reached(double start, double t) { return start <= t + 1e-12 * std::max(1.0, std::abs(t)); }

  // The first beginning or end after t, s; no step may cross it.
  double next_change(double t) const {
    double next = std::numeric_limits<double>::infinity();
    const auto offer = [&](double at) {
      if (!reached(at, t) && at < next) next = at;
    };
    for (const Push& push : pushes) offer(push.start), offer(push.end);
    for (const LostDrive& drive : lost) offer(drive.time);
    return next;
  }
};

// The pushes of one time as a generalised force.
class PushForce {
 public:
  // Those that act from time t on, until the next change.
  void select(const Loads& loads, double t) {
    active_.clear();
    for (std::size_t k = 0; k < loads.pushes.size(); ++k)
      if (Loads::reached(loads.pushes[k].start, t) && !Loads::reached(loads.pushes[k].end, t)) active_.push_back(k);
  }

  bool any() const { return !active_.empty(); }

  // Sum of J^T (force, torque) at the state last computed.
  void find(const Loads& loads, const Dynamics& dynamics, VectorXd& out) const {
    out.setZero(dynamics.tree().nv);
    for (const std::size_t k : active_) add(dynamics, loads.pushes[k], out);
  }

 private:
  static void add(const Dynamics& dynamics, const Push& push, VectorXd& out) {
    const Vec3 point = dynamics.point(push.joint, push.offset);
    const Mat3& rotation = dynamics.base_rotation();
    out.head<3>().noalias() += rotation.transpose() * push.force;
    out.segment<3>(3).noalias() += rotation.transpose() * (point.cross(push.force) + push.torque);
    for (const std::size_t joint : dynamics.tree().chain_to(push.joint)) {
      const Vec3 lever = point - dynamics.origin(joint);
      Vec3 load = push.force;
      if (!dynamics.slides(joint)) load = lever.cross(push.force) + push.torque;
      out[Eigen::Index(Tree::column(joint))] += dynamics.axis(joint).dot(load);
    }
  }

  std::vector<std::size_t> active_;
};

}  // namespace hexapod
