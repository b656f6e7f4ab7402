// Ground from a grid of heights, C1: bicubic (Catmull-Rom) between the points, level beyond the edge.
#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "laws/ground.hpp"

namespace hexapod {

class HeightField {
 public:
  // z row-major (ny, nx): z[j * nx + i] at (x0 + i dx, y0 + j dy)
  HeightField(double x0, double y0, double dx, double dy, int nx, int ny, std::vector<double> z)
      : x0_(x0), y0_(y0), dx_(dx), dy_(dy), nx_(nx), ny_(ny), z_(std::move(z)) {
    if (nx < 2 || ny < 2 || z_.size() != std::size_t(nx) * ny || !(dx > 0.0) || !(dy > 0.0))
      throw std::invalid_argument("a height field needs at least 2 x 2 points");
  }

  // The nearest point of the surface, by fixed-point steps along its normal; the gap's gradient is
  // then the normal. A sphere far above gets the distance along the normal below it.
  int find_contacts(const Vec3& center, double radius, GroundPoints& out) const {
    Vec3 n = Vec3::UnitZ();
    double gap = 0.0;
    for (int k = 0; k < kMaxIterations; ++k) {
      const Vec3 point = center - (k == 0 ? 0.0 : radius + gap) * n;
      double height, hx, hy;
      sample(point.x(), point.y(), height, hx, hy);
      n = Vec3(-hx, -hy, 1.0).normalized();
      const double next = n.dot(center - Vec3(point.x(), point.y(), height)) - radius;
      const bool done = next > dx_ || (k > 0 && std::abs(next - gap) < kConverged);
      gap = next;
      if (done) break;
    }
    out[0] = {gap, n};
    return 1;
  }

  void sample(double x, double y, double& height, double& hx, double& hy) const {
    double u = (x - x0_) / dx_, v = (y - y0_) / dy_;
    const bool out_x = !(u > 0.0 && u < nx_ - 1), out_y = !(v > 0.0 && v < ny_ - 1);
    u = std::min(std::max(u, 0.0), double(nx_ - 1));
    v = std::min(std::max(v, 0.0), double(ny_ - 1));
    const int i = std::min(int(u), nx_ - 2), j = std::min(int(v), ny_ - 2);
    double row[4], slope[4];
    for (int k = 0; k < 4; ++k) {
      const int r = std::min(std::max(j - 1 + k, 0), ny_ - 1);
      double p[4];
      for (int m = 0; m < 4; ++m) p[m] = z_[std::size_t(r) * nx_ + std::min(std::max(i - 1 + m, 0), nx_ - 1)];
      spline(p, u - i, row[k], slope[k]);
    }
    double unused;
    spline(row, v - j, height, hy);
    spline(slope, v - j, hx, unused);
    hx = out_x ? 0.0 : hx / dx_;
    hy = out_y ? 0.0 : hy / dy_;
  }

 private:
  static constexpr int kMaxIterations = 40;
  static constexpr double kConverged = 1e-14;  // m

  static void spline(const double* p, double t, double& value, double& derivative) {
    const double a = -0.5 * p[0] + 1.5 * p[1] - 1.5 * p[2] + 0.5 * p[3];
    const double b = p[0] - 2.5 * p[1] + 2.0 * p[2] - 0.5 * p[3], c = 0.5 * (p[2] - p[0]);
    value = ((a * t + b) * t + c) * t + p[1];
    derivative = (3.0 * a * t + 2.0 * b) * t + c;
  }

  double x0_, y0_, dx_, dy_;
  int nx_, ny_;
  std::vector<double> z_;
};

}  // namespace hexapod
