// PID on a tangential error of one foot: S1's correction of the foot's position.
#pragma once

#include <cmath>

#include "laws/vectors.hpp"

namespace hexapod {

struct SlipGains {
  double kp = 0.0, ki = 0.0, kd = 0.0;  // per unit of the error: m, m/s, m s
  double derivative_time = 0.0;         // of the filter of the derivative, s
  double limit = 0.0;                   // largest correction, m
};

struct SlipMemory {
  Vec3 integral = Vec3::Zero(), error = Vec3::Zero(), slope = Vec3::Zero();
  double begun = 0.0;  // 1 once an error has been seen
};

// The correction [m] for the error of a tick; `period` in s. Its length keeps to the limit, and there
// the integral grows no further (anti-windup).
inline Vec3 slip_correction(const SlipGains& gains, double period, const Vec3& error, SlipMemory& memory) {
  if (memory.begun > 0.0)
    memory.slope += (period / (gains.derivative_time + period)) *
                    ((error - memory.error) / period - memory.slope);
  memory.error = error, memory.begun = 1.0;
  const Vec3 integral = memory.integral + period * gains.ki * error;
  Vec3 out = gains.kp * error + integral + gains.kd * memory.slope;
  const double size = out.norm();
  if (size <= gains.limit) {
    memory.integral = integral;
    return out;
  }
  if (integral.norm() <= memory.integral.norm()) memory.integral = integral;
  return out * (gains.limit / size);
}

}  // namespace hexapod
