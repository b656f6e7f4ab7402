// LU of small matrices that need no pivoting: diagonally dominant by the inertia, or positive definite.
// Eigen's decompositions of fixed size cost seconds of compilation for each size.
#pragma once

#include <Eigen/Core>

namespace hexapod {

// In place; the unit diagonal of L is not kept.
template <int N>
void factor_lu(Eigen::Matrix<double, N, N>& a) {
  for (int k = 0; k < N; ++k) {
    const double inverse = 1.0 / a(k, k);
    for (int i = k + 1; i < N; ++i) a(i, k) *= inverse;
    for (int j = k + 1; j < N; ++j)
      for (int i = k + 1; i < N; ++i) a(i, j) -= a(i, k) * a(k, j);
  }
}

template <int N>
void solve_lu(const Eigen::Matrix<double, N, N>& lu, Eigen::Matrix<double, N, 1>& x) {
  for (int k = 0; k < N; ++k)
    for (int i = k + 1; i < N; ++i) x[i] -= lu(i, k) * x[k];
  for (int k = N - 1; k >= 0; --k) {
    x[k] /= lu(k, k);
    for (int i = 0; i < k; ++i) x[i] -= lu(i, k) * x[k];
  }
}

}  // namespace hexapod
