// What of the feet's forces serves nothing: the tangential forces with which feet work against each other.
#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cmath>

#include "control/walk_table.hpp"
#include "laws/vectors.hpp"

namespace hexapod {

using LegVectors = std::array<Vec3, kLegs>;
using LegNumbers = std::array<double, kLegs>;

// Least-squares plane z = a + b x + c y through points with weights; (a, b, c). Slopes are drawn to 0
// where the points do not determine them: as by a further point's worth at `kNear` from the middle.
inline Vec3 fitted_plane(const LegVectors& points, const LegNumbers& weight) {
  constexpr double kNear = 0.01;  // m
  Mat3 normal = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for (int l = 0; l < kLegs; ++l) {
    const Vec3 row(1.0, points[l].x(), points[l].y());
    normal += weight[l] * row * row.transpose();
    right += weight[l] * points[l].z() * row;
  }
  if (!(normal(0, 0) > 0.0)) return Vec3::Zero();
  const Vec3 mean = normal.col(0) / normal(0, 0);  // 1 and the middle
  const Vec2 middle = mean.tail<2>();
  Mat2 spread = normal.bottomRightCorner<2, 2>() - normal(0, 0) * middle * middle.transpose();
  spread.diagonal().array() += kNear * kNear;
  const double height = right[0] / normal(0, 0);
  const Vec2 slope = spread.inverse() * (right.tail<2>() - right[0] * middle);
  return {height - slope.dot(middle), slope[0], slope[1]};
}

// A motion of all feet together within the ground: of their middle, and a turn about the normal.
struct PlanarMotion {
  Vec3 middle = Vec3::Zero(), shift = Vec3::Zero();
  double turn = 0.0;

  Vec3 at(const Vec3& foot, const Vec3& normal) const {
    return shift + turn * normal.cross(foot - middle);
  }
};

// The one that is nearest to what the feet do, by weighted least squares.
inline PlanarMotion common_motion(const LegVectors& feet, const LegVectors& moved, const LegNumbers& weight,
                                  const Vec3& normal) {
  PlanarMotion out;
  double all = 0.0, spread = 0.0, moment = 0.0;
  for (int l = 0; l < kLegs; ++l) {
    if (!(weight[l] > 0.0)) continue;
    all += weight[l], out.middle += weight[l] * feet[l], out.shift += weight[l] * moved[l];
  }
  if (!(all > 0.0)) return out;
  out.middle /= all, out.shift /= all;
  for (int l = 0; l < kLegs; ++l) {
    if (!(weight[l] > 0.0)) continue;
    const Vec3 arm = normal.cross(feet[l] - out.middle);
    spread += weight[l] * arm.squaredNorm(), moment += weight[l] * arm.dot(moved[l]);
  }
  if (spread > 0.0) out.turn = moment / spread;
  return out;
}

// Tangential forces less those that feet would need which share the sum and the moment about the normal
// in proportion to their loads: what is left drives the trunk nowhere, N.
inline LegVectors internal_forces(const LegVectors& feet, const LegVectors& tangential,
                                  const LegNumbers& load, const Vec3& normal) {
  LegVectors per_load, out;
  for (int l = 0; l < kLegs; ++l)
    per_load[l] = load[l] > 0.0 ? Vec3(tangential[l] / load[l]) : Vec3::Zero();
  const PlanarMotion shared = common_motion(feet, per_load, load, normal);
  for (int l = 0; l < kLegs; ++l)
    out[l] = load[l] > 0.0 ? Vec3(tangential[l] - load[l] * shared.at(feet[l], normal)) : Vec3::Zero();
  return out;
}

}  // namespace hexapod
