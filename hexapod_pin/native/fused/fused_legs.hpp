// Border of the fused pass: mass matrix, bias and kinematics of a floating base with up to eight
// serial legs of three revolute joints. Plain doubles and no inline code: this header goes into
// units that are compiled for different processors.
#pragma once

namespace hexapod::fused {

constexpr int kMostLegs = 8;
using PerLeg = double[kMostLegs];  // zeros for a leg that does not exist

// A joint and the body after it, in all legs. The body's axes here have z along the joint's axis.
struct alignas(64) Joint {
  PerLeg placement[9];  // rotation to the parent's axes at q = 0, by columns
  PerLeg offset[3];     // of the origin, parent's axes, m
  PerLeg mass, com[3];  // kg; m, body's axes
  PerLeg inertia[6];    // about the centre of mass, body's axes: xx xy yy xz yz zz, kg m^2
  PerLeg armature;      // kg m^2
};

struct Robot {
  Joint joint[3] = {};
  int legs = 0;
  double mass = 0.0, first[3] = {}, second[6] = {};  // base: kg; m c; inertia about its origin
  double armature[6] = {};                           // of the base's own coordinates
  double total_mass = 0.0;
  double gravity[3] = {};  // world axes, m/s^2
};

// Where the numbers go. Joints are counted leg by leg, base side first, three numbers each.
struct Result {
  double* mass;           // column-major, 6 + 3 legs rows; nonzeros on and above the diagonal
  double* bias;           // C v + g
  double* base_rotation;  // to the world, by columns
  double *axis, *origin;  // world axes, from the base's origin
  double* first_moment;   // of the whole robot, base axes, kg m
  PerLeg (*rotation)[9];  // of each joint's body to base axes, by columns
};

// q: base quaternion x y z w, joint angles. v: base twist in base axes, linear first; joint rates.
using Pass = void (*)(const Robot& robot, const double* q, const double* v, const Result& result);

// One source, compiled for every processor of the target and for AVX2 with FMA (nullptr where the
// compiler has none). The two differ by round-off; each alone gives the same bits in every run and
// for any number of threads.
extern const Pass kBaselineBuild, kAvx2Build;

}  // namespace hexapod::fused
