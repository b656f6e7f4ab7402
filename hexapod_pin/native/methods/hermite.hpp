// Cubics by values and slopes at both ends of (0, 1). Pure functions.
#pragma once

namespace hexapod {

// First root in (0, 1) of the cubic with values a, b and slopes da, db at 0 and 1; a > 0 > b.
inline double hermite_root(double a, double da, double b, double db) {
  double low = 0.0, high = 1.0;
  for (int k = 0; k < 60; ++k) {
    const double s = 0.5 * (low + high), s2 = s * s, s3 = s2 * s;
    const double value = (2 * s3 - 3 * s2 + 1) * a + (s3 - 2 * s2 + s) * da +
                         (3 * s2 - 2 * s3) * b + (s3 - s2) * db;
    (value > 0.0 ? low : high) = s;
  }
  return 0.5 * (low + high);
}

// The cubic's least value in (0, 1), where it falls at 0 and rises at 1, and where that is.
inline double hermite_minimum(double a, double da, double b, double db, double& where) {
  double low = 0.0, high = 1.0;
  for (int k = 0; k < 60; ++k) {
    const double s = 0.5 * (low + high);
    const double slope = 6.0 * (s * s - s) * (a - b) + (3.0 * s * s - 4.0 * s + 1.0) * da +
                         (3.0 * s * s - 2.0 * s) * db;
    (slope < 0.0 ? low : high) = s;
  }
  const double s = where = 0.5 * (low + high), s2 = s * s, s3 = s2 * s;
  return (2 * s3 - 3 * s2 + 1) * a + (s3 - 2 * s2 + s) * da + (3 * s2 - 2 * s3) * b + (s3 - s2) * db;
}

}  // namespace hexapod
