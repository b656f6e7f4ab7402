"""The numbers and rules by which a URDF is judged and repaired, each with its reason."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from hexapod_pin.file_schema import LONGEST_NAME
from hexapod_pin.robot.description.urdf_file import JOINT_TYPES, LARGEST_LENGTH

Severity = Literal["refused", "suspicious"]

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

MASS_PER_LEG = (20.0, 300.0)
"""Total mass over the cube of the length of the longest leg [kg/m^3].

Thirteen public hexapods with stated masses have 25 to 245, the packaged robots 113 and 150."""

MOTOR_MASS = (0.005, 0.025)
"""Mass of a motor that moves a joint, of the smallest hobby servo and of a small one with its
bracket [kg] (*assumed*): every robot has that of its motors at least, and a small one may have it
beside what its size lets expect."""

USUAL_MASS_PER_LEG = 110.0
"""The geometric mean of those robots [kg/m^3]."""

WALKERS_PER_SPAN = (2.0, 50.0)
"""The same of walking robots [kg/m^3]."""

USUAL_MASS_PER_SPAN = 10.0
"""The geometric mean of walking robots' mass over the cube of the span of their joints [kg/m^3]."""

HEAVY = 3.0
"""Mass over the largest plausible one from which the repair replaces it [-]."""

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

CENTRE_OFF_JOINTS = 2.0
"""The same of a link of which nothing is drawn from its joint, over the distance to the next one:
18 robots have 0 to 0.91."""

JOINT_RANGE = 2.618
"""Limits -2.618 to 2.618 rad, *assumed* where none are given: 300 degrees, the range of a
DYNAMIXEL AX-12A in joint mode (ROBOTIS e-Manual)."""

FULL_TURN = 2.0 * math.pi
"""A revolute joint's range above one turn is no limit [rad]."""

DEGREES = (15.0, 360.0)
"""Limits of a range above a turn that are usual in degrees; taken for radians they allow 2 to 57
turns (*assumed*)."""

FEWEST_NARROW = 6
"""Joints of legs from which ranges of a few hundredths of a radian are taken for a wrong unit."""

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

RESISTANCE = 1.0
"""Torque by damping, at the joint's speed, or friction of a joint over what standing on three feet
takes, from which it is doubted (*assumed*): geared servos have a tenth."""

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

MAX_MOVED_JOINTS = 300
"""Larger models are refused: the mass matrix and its workspace grow with the square."""


class Rule(NamedTuple):
    """What is allowed, what the repair does, and the other fields of a `Finding`."""

    rule: str
    repair: str
    severity: Severity = "refused"
    repairable: bool = True


RULES = {
    "no link": Rule("a robot needs at least one", "give the whole file", repairable=False),
    "too many joints": Rule(
        f"at most {MAX_MOVED_JOINTS} are simulated",
        "make joints that do not matter fixed",
        repairable=False,
    ),
    "text before XML": Rule(
        "an XML declaration stands first; other parsers refuse this", "dropped", "suspicious"
    ),
    "unbound prefix": Rule(
        "prefixes are declared by xmlns; other parsers refuse this", "declared", "suspicious"
    ),
    "loop": Rule(
        "the links must form a tree", "remove the joint that closes the loop", repairable=False
    ),
    "fixed to the world": Rule(
        "a walking robot's trunk is free: here it floats, elsewhere it does not",
        "link and joint are dropped",
        "suspicious",
    ),
    "name that cannot be printed": Rule(
        f"at most {LONGEST_NAME}, without control and direction characters",
        "name it otherwise",
        repairable=False,
    ),
    "duplicate name": Rule(
        "names must be unique", "identical copies dropped, others numbered, joints follow"
    ),
    "unreadable origin": Rule(
        f"xyz [m] and rpy [rad] are three numbers each, xyz at most {LARGEST_LENGTH:g} m",
        "write the numbers",
        repairable=False,
    ),
    "unknown joint type": Rule(
        f"known: {', '.join(JOINT_TYPES)}", "revolute where it has limits and an axis, else fixed"
    ),
    "coupled joint": Rule(
        "coupled joints are not simulated", "the coupling is dropped: the joint moves by itself"
    ),
    "zero axis": Rule("must be a unit vector", "the joint is made fixed"),
    "unreadable element": Rule(
        "parsers refuse missing and non-finite numbers, of fixed joints too",
        "the element is dropped",
    ),
    "axis not of unit length": Rule("made a unit vector", "made a unit vector", "suspicious"),
    "too dense": Rule(
        f"at most ten times as dense as osmium ({HEAVIEST:g} kg/m^3)",
        "check its mass and shape: one link alone does not show a unit",
        "suspicious",
        repairable=False,
    ),
    "centre of mass outside": Rule(
        "lies within the body", "the centre of the link's solid", "suspicious"
    ),
    "mesh scale": Rule("three numbers other than 0", "scale 1 1 1", "suspicious"),
    "mesh not found": Rule(
        "a file that can be found",
        "give its package's folder by package_path=[...]",
        "suspicious",
        repairable=False,
    ),
    "material defined twice": Rule(
        "once; other parsers refuse this", "the others are dropped", "suspicious"
    ),
    "mesh without volume": Rule(
        "a mesh of a solid in STL, DAE or OBJ",
        "export it as a closed solid; the link counts as having no shape",
        "suspicious",
        repairable=False,
    ),
    "unreadable colour": Rule("four numbers from 0 to 1", "the colour is dropped", "suspicious"),
    "unreadable shape": Rule(
        "a geometry of a size above 0, at a place of three numbers, both at most"
        f" {LARGEST_LENGTH:g} m",
        "the shape is dropped",
        "suspicious",
    ),
    "colour out of range": Rule(
        "four numbers from 0 to 1",
        "divided by 255 where one is above 1, else limited",
        "suspicious",
    ),
    "absurd size": Rule(
        f"{SPAN[0]:g} to {SPAN[1]:g} m is plausible",
        "no unit explains it; scale the lengths",
        "suspicious",
        repairable=False,
    ),
}
"""Rules by kind of fault; other kinds depend on the file."""
