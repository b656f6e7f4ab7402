"""The numbers by which a URDF is judged and repaired, each with its reason."""

from __future__ import annotations

import math

DENSITY = 430.0
"""Mass over volume of the links' convex hulls [kg/m^3], *assumed* where no mass is known.

The median of twelve public hexapods with stated masses (170 to 1330; printed or cut parts around
servos)."""

LIGHTEST, HEAVIEST = 1.2, 22_600.0
"""Densities between which a link is a body [kg/m^3]: air at 20 degrees C, osmium."""

DENSEST_LINK = 10.0 * HEAVIEST
"""One link alone may be drawn ten times too small before that is reported [kg/m^3]."""

MASS_PER_SPAN = (0.2, 600.0)
"""Total mass over the cube of the span of the joints [kg/m^3]; walking robots have 2 to 50."""

SPAN = (5e-3, 20.0)
"""Span of all joints [m]: from robots of millimetres to the largest walking machines."""

UNIT_SLIP = math.sqrt(1000.0)
"""A length that exceeds the span of the joints by more is in mm (the middle of 1 and 1000)."""

GYRATION = (0.01, 2.0)
"""Radius of gyration over the diagonal of the link's solid; no body exceeds 1, a box has 0.29."""

GYRATION_OF_SKELETON = (0.01, 10.0)
"""The same over the distance to the next joints, where a link has no solid."""

TYPICAL_GYRATION = 0.25
"""Radius of gyration over the diagonal of a body: a box to a rod have 0.20 to 0.29."""

CENTRE_OFFSET = 3.0
"""Largest distance of the centre of mass from the centre of the link's solid over its diagonal."""

JOINT_RANGE = 2.618
"""Limits -2.618 to 2.618 rad, *assumed* where none are given: 300 degrees, the range of a
DYNAMIXEL AX-12A in joint mode (ROBOTIS e-Manual)."""

FULL_TURN = 2.0 * math.pi
"""A revolute joint's range above one turn is no limit [rad]."""

SPEED = 6.0
"""Joint speed [rad/s], *assumed* where none is given.

69 published operating points of hobby and smart servos (ROBOTIS e-Manual and others) have no-load
speeds from 2.8 to 12.9, median 6.2."""

SPEEDS = (1.0, 60.0)
"""Plausible speeds [rad/s]: the slowest servo of that list turns at 2.8; the fastest actuators of
legged robots at 40 (Katz, Di Carlo, Kim: Mini Cheetah, ICRA 2019)."""

TORQUE_FACTOR = 3.0
"""Torque limit over the static holding torque, *assumed*: a servo must not stall while it stands,
lifts two thirds of the legs and pushes."""

TORQUES = (0.02, 20.0)
"""Plausible torque limits over weight times leg length; 1 lifts the robot on one stretched leg."""

SMALL_SHARE = 0.005
"""Share of the total mass of a moved link of which nothing is drawn, *assumed*."""

SMALL_SIZE = 0.02
"""Radius of a link of which nothing is drawn over the span of the joints, *assumed*."""

SLENDERNESS = 0.2
"""Radius over length of the rod that stands for a link of which nothing is drawn, and half the
height over the smaller side of the box around a trunk's joints, *assumed*."""

FLATNESS = 1e-6
"""Least thickness of a repaired inertia: each second moment of mass over their sum."""

GRAVITY = 9.81
"""[m/s^2]"""
