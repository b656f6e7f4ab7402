// The fused pass. Every body is described in base axes about the base's origin, so nothing is
// transformed on the way from body to body: Featherstone, Rigid Body Dynamics Algorithms (2008),
// chapters 5 (bias) and 6 (mass matrix), in one frame. `kWidth` legs run side by side.
#pragma once

#include "fused/fused_bodies.hpp"
#include "fused/fused_legs.hpp"
#include "fused/fused_sincos.hpp"

namespace hexapod::fused {
namespace {

struct Frame {
  Mat<Lanes> rotation;
  Vec<Lanes> origin;
};

struct Link {
  Vec<Lanes> z, s;         // joint axis; its velocity at the base's origin
  Inertia<Lanes> inertia;  // later of all that follows too
  Load<Lanes> load;
};

inline Inertia<Lanes> inertia_of(const Joint& joint, int leg, const Frame& at) {
  const Lanes mass = load(joint.mass + leg);
  const Vec<Lanes> com = at.origin + at.rotation * load3(joint.com, leg), first = com * mass;
  const Vec<Lanes> upper = load3(joint.inertia, leg), lower = load3(joint.inertia + 3, leg);
  const Sym<Lanes> own = {upper.x, upper.y, upper.z, lower.x, lower.y, lower.z};
  return {mass, first, turned(at.rotation, own) + lever_inertia(first, com)};
}

// From the body before the joint to the one after it.
inline void turn(const Joint& joint, int leg, Lanes angle, Frame& at) {
  const PerLeg* p = joint.placement;
  const Vec<Lanes> x = at.rotation * load3(p, leg), y = at.rotation * load3(p + 3, leg);
  const Vec<Lanes> z = at.rotation * load3(p + 6, leg);
  at.origin = at.origin + at.rotation * load3(joint.offset, leg);
  const SinCos a = sin_cos(angle);
  at.rotation = {x * a.cos + y * a.sin, y * a.cos + x * -a.sin, z};
}

inline void move(Motion<Lanes>& m, const Link& link, Lanes rate) {
  const Vec<Lanes> sw = link.z * rate, sv = link.s * rate;
  m.a = m.a + cross(m.w, sv) + cross(m.v, sw);
  m.alpha = m.alpha + cross(m.w, sw);
  m.w = m.w + sw;
  m.v = m.v + sv;
}

// What goes leg by leg into the result, still side by side.
struct alignas(64) Rows {
  double axis[9][kWidth], origin[9][kWidth], torque[3][kWidth];
  double base_column[3][6][kWidth], leg_column[3][3][kWidth];
};

inline void put(double (*rows)[kWidth], const Vec<Lanes>& v) {
  store(rows[0], v.x);
  store(rows[1], v.y);
  store(rows[2], v.z);
}

// Leg-inwards: torques and columns of the mass matrix; what the base carries ends up in link[0].
inline void gather(const Robot& robot, int leg, Link (&link)[3], Rows& rows) {
  for (int j = 2; j >= 0; --j) {
    const Link& l = link[j];
    store(rows.torque[j], dot(l.z, l.load.moment) + dot(l.s, l.load.force));
    const Load<Lanes> p = momentum(l.inertia, l.s, l.z);
    put(rows.base_column[j], p.force);
    put(rows.base_column[j] + 3, p.moment);
    for (int k = 0; k < j; ++k)
      store(rows.leg_column[j][k], dot(link[k].z, p.moment) + dot(link[k].s, p.force));
    const Lanes own = dot(l.z, p.moment) + dot(l.s, p.force);
    store(rows.leg_column[j][j], own + load(robot.joint[j].armature + leg));
    if (j == 0) return;
    add(link[j - 1].inertia, l.inertia);
    add(link[j - 1].load, l.load);
  }
}

inline void scatter(const Rows& rows, int lane, int first, int nv, const Result& out) {
  for (int i = 0; i < 9; ++i) out.axis[3 * first + i] = rows.axis[i][lane];
  for (int i = 0; i < 9; ++i) out.origin[3 * first + i] = rows.origin[i][lane];
  for (int j = 0; j < 3; ++j) {
    out.bias[6 + first + j] = rows.torque[j][lane];
    double* column = out.mass + (6 + first + j) * nv;
    for (int i = 0; i < 6; ++i) column[i] = rows.base_column[j][i][lane];
    for (int k = 0; k <= j; ++k) column[6 + first + k] = rows.leg_column[j][k][lane];
  }
}

inline void store_rotation(const Mat<Lanes>& r, PerLeg* to, int leg) {
  const Vec<Lanes>* columns[3] = {&r.x, &r.y, &r.z};
  for (int k = 0; k < 3; ++k) {
    store(to[3 * k] + leg, columns[k]->x);
    store(to[3 * k + 1] + leg, columns[k]->y);
    store(to[3 * k + 2] + leg, columns[k]->z);
  }
}

// Legs `leg` ... `leg + count - 1`; what they add to the base goes to `inertia` and `total`.
inline void run_legs(const Robot& robot, int leg, int count, const double* angles,
                     const double* rates, const Mat<double>& base, const Motion<double>& start,
                     const Result& out, Inertia<Lanes>& inertia, Load<Lanes>& total) {
  double angle[3][kWidth] = {}, rate[3][kWidth] = {};
  for (int i = 0; i < 3 * count; ++i) {
    angle[i % 3][i / 3] = angles[3 * leg + i];
    rate[i % 3][i / 3] = rates[3 * leg + i];
  }
  Motion<Lanes> m = {spread(start.v), spread(start.w), spread(start.a), spread(start.alpha)};
  Frame at = {{spread({1, 0, 0}), spread({0, 1, 0}), spread({0, 0, 1})}, {}};
  Link link[3];
  Rows rows;
  for (int j = 0; j < 3; ++j) {
    turn(robot.joint[j], leg, load(angle[j]), at);
    link[j].z = at.rotation.z;
    link[j].s = cross(at.origin, at.rotation.z);
    link[j].inertia = inertia_of(robot.joint[j], leg, at);
    move(m, link[j], load(rate[j]));
    link[j].load = load_of(link[j].inertia, m);
    store_rotation(at.rotation, out.rotation[j], leg);
    put(rows.axis + 3 * j, base * at.rotation.z);
    put(rows.origin + 3 * j, base * at.origin);
  }
  gather(robot, leg, link, rows);
  for (int l = 0; l < count; ++l) scatter(rows, l, 3 * (leg + l), 6 + 3 * robot.legs, out);
  add(inertia, link[0].inertia);
  add(total, link[0].load);
}

inline Mat<double> rotation_of(const double* quaternion) {
  const double x = quaternion[0], y = quaternion[1], z = quaternion[2], w = quaternion[3];
  const double tx = 2.0 * x, ty = 2.0 * y, tz = 2.0 * z;
  return {{1.0 - (ty * y + tz * z), ty * x + tz * w, tz * x - ty * w},
          {ty * x - tz * w, 1.0 - (tx * x + tz * z), tz * y + tx * w},
          {tz * x + ty * w, tz * y - tx * w, 1.0 - (tx * x + ty * y)}};
}

// M's base block [m 1, -h^; h^, I] and the base's bias
inline void put_base(const Robot& robot, const Vec<double>& h, const Sym<double>& i,
                     const Load<double>& f, const Result& out) {
  const double m = robot.total_mass;
  const double upper[6][6] = {{m},
                              {0, m},
                              {0, 0, m},
                              {0, -h.z, h.y, i.xx},
                              {h.z, 0, -h.x, i.xy, i.yy},
                              {-h.y, h.x, 0, i.xz, i.yz, i.zz}};
  for (int c = 0; c < 6; ++c) {
    double* column = out.mass + c * (6 + 3 * robot.legs);
    for (int r = 0; r <= c; ++r) column[r] = upper[c][r];
    column[c] += robot.armature[c];
  }
  store3(out.bias, f.force);
  store3(out.bias + 3, f.moment);
  store3(out.first_moment, h);
}

inline void run(const Robot& robot, const double* q, const double* v, const Result& out) {
  const Mat<double> base = rotation_of(q);
  store3(out.base_rotation, base.x);
  store3(out.base_rotation + 3, base.y);
  store3(out.base_rotation + 6, base.z);
  const Vec<double> g = load3(robot.gravity);
  const Motion<double> m = {
      load3(v), load3(v + 3), {-dot(base.x, g), -dot(base.y, g), -dot(base.z, g)}, {0, 0, 0}};
  const double* i = robot.second;
  Inertia<double> inertia = {robot.mass, load3(robot.first), {i[0], i[1], i[2], i[3], i[4], i[5]}};
  Load<double> load = load_of(inertia, m);
  Inertia<Lanes> legs = {};
  Load<Lanes> leg_load = {};
  for (int leg = 0; leg < robot.legs; leg += kWidth) {
    const int count = robot.legs - leg < kWidth ? robot.legs - leg : kWidth;
    run_legs(robot, leg, count, q + 4, v + 6, base, m, out, legs, leg_load);
  }
  add(load, {sum(leg_load.force), sum(leg_load.moment)});
  add(inertia, {sum(legs.mass), sum(legs.first), sum(legs.second)});
  put_base(robot, inertia.first, inertia.second, load, out);
}

}  // namespace
}  // namespace hexapod::fused
