// The history of a multistep method as backward differences at equal steps, and the formulas NDF 1-5
// on it (Shampine & Reichelt, The MATLAB ODE Suite, 1997; steps as SciPy's BDF).
#pragma once

#include <array>

#include <Eigen/Core>

namespace hexapod {

class BackwardDifferences {
  using VectorXd = Eigen::VectorXd;

 public:
  static constexpr int kMaxOrder = 5;

  // A history of one point with its slope, at order 1.
  void restart(const VectorXd& y, const VectorXd& slope, double h) {
    d_.setZero(y.size(), kMaxOrder + 3);
    d_.col(0) = y;
    d_.col(1) = h * slope;
    order_ = 1;
  }

  bool empty() const { return d_.rows() == 0; }
  int order() const { return order_; }
  void set_order(int order) { order_ = order; }
  auto last() const { return d_.col(0); }  // the last accepted point
  auto of(int j) const { return d_.col(j); }

  // The formula is c y' = psi + d at y = predicted + d, c = h/alpha.
  static double alpha(int k) { return (1.0 - kKappa[k]) * gamma(k); }
  static double error_constant(int k) { return kKappa[k] * gamma(k) + 1.0 / (k + 1.0); }

  void predict(VectorXd& y) const { y = d_.leftCols(order_ + 1).rowwise().sum(); }

  void psi(VectorXd& out) const {
    out.setZero(d_.rows());
    for (int j = 1; j <= order_; ++j) out += (gamma(j) / alpha(order_)) * d_.col(j);
  }

  // The polynomial through the history, `x` steps after the last point.
  void at(double x, VectorXd& y) const {
    y = d_.col(0);
    double product = 1.0;
    for (int j = 1; j <= order_; ++j) {
      product *= (x + j - 1.0) / j;
      y += product * d_.col(j);
    }
  }

  // The same with the new point, d away from the predicted, before it is appended; x counts from it.
  void at_with(const VectorXd& d, double x, VectorXd& y) {
    std::array<double, kMaxOrder + 2> product{1.0};
    for (int j = 1; j <= order_; ++j) product[j] = product[j - 1] * (x + j - 1.0) / j;
    difference_ = d;
    y.setZero(d.size());
    for (int j = order_; j >= 0; --j) {
      difference_ += d_.col(j);
      y += product[j] * difference_;
    }
  }

  // Appends the new point, d away from the predicted.
  void accept(const VectorXd& d) {
    d_.col(order_ + 2) = d - d_.col(order_ + 1);
    d_.col(order_ + 1) = d;
    for (int j = order_; j >= 0; --j) d_.col(j) += d_.col(j + 1);
  }

  // The same polynomial at steps `factor` times as long.
  void rescale(double factor) {
    const int n = order_ + 1;
    Square r = powers(factor), u = powers(1.0);
    const Square ru = r.topLeftCorner(n, n) * u.topLeftCorner(n, n);
    d_.leftCols(n) = (d_.leftCols(n) * ru).eval();
  }

  void clear_rows(int first, int count) { d_.middleRows(first, count).setZero(); }

 private:
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxOrder + 1,
                               kMaxOrder + 1>;
  static constexpr std::array<double, kMaxOrder + 2> kKappa = {
      0.0, -0.1850, -1.0 / 9.0, -0.0823, -0.0415, 0.0, 0.0};

  static double gamma(int k) {  // 1 + 1/2 + .. + 1/k
    double sum = 0.0;
    for (int j = 1; j <= k; ++j) sum += 1.0 / j;
    return sum;
  }

  Square powers(double factor) const {
    Square m = Square::Zero(order_ + 1, order_ + 1);
    m.row(0).setOnes();
    for (int i = 1; i <= order_; ++i)
      for (int j = 1; j <= order_; ++j) m(i, j) = m(i - 1, j) * (i - 1 - factor * j) / i;
    return m;
  }

  Eigen::Matrix<double, Eigen::Dynamic, kMaxOrder + 3> d_;
  VectorXd difference_;
  int order_ = 1;
};

}  // namespace hexapod
