// Friction of one contact over a step: w + gamma(|w|) G w = u in the eigenbasis of G, for the end
// slip w. The friction impulse is -gamma(|w|) w.
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "laws/friction.hpp"

namespace hexapod {

using Vec2 = Eigen::Vector2d;
using Mat2 = Eigen::Matrix2d;

struct Grip {
  double gamma = 0.0;     // m/s, of the impulse m at slip speed s, N s/(m/s)
  double slope = 0.0;     // dm/ds
  double per_push = 0.0;  // dm/d(normal impulse)
};

// The impulse m(s) under a normal impulse. A bristle is the law min(kappa s, cap) of a slip shifted by
// its stretch.
class SlipLaw {
 public:
  SlipLaw() = default;
  SlipLaw(const FrictionLaw& law, double mu_scale, bool sliding, double h, double weight)
      : law_(&law), scale_(mu_scale) {
    bristle_ = law.kind == FrictionKind::bristle;
    mu_ = mu_scale * (bristle_ ? (sliding ? law.mu_dynamic : law.mu)
                               : std::max(law.mu, law.mu_dynamic));
    kappa_ = bristle_ ? weight * (h * law.bristle_stiffness + law.bristle_damping) : 0.0;
    stiffest_ = bristle_ ? 0.0 : mu_scale * steepest(law);
  }

  bool none() const { return law_->kind == FrictionKind::none; }
  double cap(double push) const { return mu_ * push; }
  double stiffest(double push) const { return bristle_ ? kappa_ : stiffest_ * push; }
  double width(double push) const {  // slip speed at which the law bends
    return cap(push) / std::max(stiffest(push), 1e-300);
  }

  bool slides(double s, double push) const { return kappa_ * s > mu_ * push; }  // of a bristle

  Grip operator()(double s, double push) const {
    if (!bristle_) {
      const FrictionFactor f = (*law_)(s);
      const double gamma = scale_ * f.ratio, slope = scale_ * (f.ratio + f.slope * s * s);
      return {push * gamma, push * slope, gamma * s};
    }
    if (kappa_ * s <= mu_ * push) return {kappa_, kappa_, 0.0};
    return {mu_ * push / s, 0.0, mu_};
  }

 private:
  static double steepest(const FrictionLaw& law) {  // largest m/s over N
    if (law.kind == FrictionKind::smooth_step) return 1.2 * law.mu / law.stiction_speed;
    return law(0.0).ratio;
  }

  const FrictionLaw* law_ = nullptr;
  bool bristle_ = false;
  double scale_ = 1.0, mu_ = 0.0, kappa_ = 0.0, stiffest_ = 0.0;
};

struct Slip {
  Vec2 impulse = Vec2::Zero();
  Mat2 by_u = Mat2::Zero();       // d impulse/du
  Vec2 by_push = Vec2::Zero();    // d impulse/d(normal impulse)
};

// `speed`: a guess of |w|, then |w|. `rising`: take a falling m(s) as level in the derivatives.
class SlipProblem {
 public:
  SlipProblem(const SlipLaw& law, double g1, double g2) : law_(law), g1_(g1), g2_(g2) {}

  Slip solve(const Vec2& u, double push, double& speed, bool rising) const {
    if (push <= 0.0) return {};
    const double size = u.norm();
    if (size < 1e-14) {
      const Grip grip = law_(0.0, push);
      Slip out;
      out.by_u.diagonal() << -grip.gamma / (1.0 + grip.gamma * g1_),
          -grip.gamma / (1.0 + grip.gamma * g2_);
      return out;
    }
    const Grip grip = find(u, size, push, speed);
    const double slope = rising ? std::max(grip.slope, 0.0) : grip.slope;
    return differentiate(u, speed, {grip.gamma, slope, grip.per_push});
  }

 private:
  static constexpr int kMost = 60;

  // Newton on 1/|w/s| - 1, concave and increasing for a concave m(s): monotone from the left. The
  // bracket is for laws that fall.
  Grip find(const Vec2& u, double size, double push, double& speed) const {
    double low = std::max(size - g1_ * law_.cap(push), size / (1.0 + g1_ * law_.stiffest(push)));
    double high = size, s = std::min(std::max(speed, low), high);
    const double u1 = u.x() * u.x(), u2 = u.y() * u.y();
    for (int k = 0; k < kMost; ++k) {
      const Grip grip = law_(s, push);
      const double i1 = 1.0 / (s * (1.0 + grip.gamma * g1_));
      const double i2 = 1.0 / (s * (1.0 + grip.gamma * g2_));
      const double p1 = u1 * i1 * i1, p2 = u2 * i2 * i2, sum = p1 + p2;
      const double fall =
          p1 * i1 * (1.0 + grip.slope * g1_) + p2 * i2 * (1.0 + grip.slope * g2_);
      (sum > 1.0 ? low : high) = s;  // w too long: s too small
      double ds = sum * (std::sqrt(sum) - 1.0) / fall;
      if (std::abs(ds) < 1e-5 * s) {
        speed = s + ds;
        const double m = grip.gamma * s + grip.slope * ds;
        return {m / speed, grip.slope, grip.per_push};
      }
      const double next = s + ds;
      s = next > low && next < high ? next : 0.5 * (low + high);
    }
    speed = s;
    return law_(s, push);
  }

  Slip differentiate(const Vec2& u, double s, const Grip& grip) const {
    const Vec2 w(u.x() / (1.0 + grip.gamma * g1_), u.y() / (1.0 + grip.gamma * g2_));
    const Vec2 e = w / s;
    Mat2 t = (grip.slope - grip.gamma) * e * e.transpose();
    t.diagonal().array() += grip.gamma;
    Mat2 a = t * Vec2(g1_, g2_).asDiagonal();
    a.diagonal().array() += 1.0;
    const Mat2 inverse = a.inverse();
    return {-grip.gamma * w, -inverse * t, -grip.per_push * (inverse * e)};
  }

  const SlipLaw& law_;
  double g1_, g2_;
};

}  // namespace hexapod
