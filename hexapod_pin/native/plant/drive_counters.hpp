// How often and how long joints were at their torque limits, and how often they ran into a stop.
#pragma once

#include <vector>

#include "laws/drive.hpp"

namespace hexapod {

// One entry per joint, over the accepted steps of a run.
struct DriveCounters {
  std::vector<long> limit_count;  // times the torque limit was reached
  VectorXd limit_time;            // at it, s
  std::vector<long> stop_count;   // times a stop was run into

  explicit DriveCounters(int joints)
      : limit_count(joints), limit_time(VectorXd::Zero(joints)), stop_count(joints), last_(joints) {}

  bool idle() const { return !busy_; }  // no joint was at a limit or stop in the last step

  // A step of dt in which a joint was in these modes; joints in their order. Not needed where all are
  // free of both and the counters are idle.
  void add(int joint, LimitMode limit, StopMode stop, double dt) {
    Last& last = last_[joint];
    const bool at_limit = limit != LimitMode::within, at_stop = stop != StopMode::free;
    if (at_limit) limit_time[joint] += dt;
    if (at_limit && !last.at_limit) ++limit_count[joint];
    if (at_stop && !last.at_stop) ++stop_count[joint];
    last = {at_limit, at_stop};
    busy_ = at_limit || at_stop || (joint > 0 && busy_);
  }

 private:
  struct Last {
    bool at_limit = false, at_stop = false;
  };
  std::vector<Last> last_;
  bool busy_ = false;
};

}  // namespace hexapod
