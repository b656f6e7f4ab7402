"""The two robots of the source papers, each as one table; `scripts/build_urdf.py` writes them."""

from __future__ import annotations

from math import pi, radians

from hexapod_pin.robot.description.blueprint import Blueprint, Segment, Trunk, six_hips
from hexapod_pin.robot.description.solids import kg_mm2, mm

_TURN = radians(60)
_LIFT = radians(75)
_COXA, _FEMUR, _TIBIA = mm(83.5, 119.34, 98.79)

KHARAGPUR = Blueprint(
    name="kharagpur",
    title="Hexapod of IIT Kharagpur / CMERI (S2)",
    source=(
        "S2 Table 1: masses, inertias, lengths, total mass; joint torque limit from the group's"
        " later chapter in CAD/CAM, Robotics and Factories of the Future"
    ),
    assumed=(
        "hips at x = +0.2, 0, -0.2 m, y = +-0.1025 m, z = 0",
        "centre of mass of every leg link at mid-link",
        "foot sphere of radius 0.010 m, centred on the end of the tibia",
        "the 0.63146 kg of additional parts as a point mass at the trunk's centre of mass",
        "joint limits: coxa +-60 deg, femur +-75 deg, tibia 0 to 160 deg",
        "joint velocity limit 6 rad/s",
        "no joint damping",
        "odd leg numbers on the left: legs 1 to 6 are lf, rf, lm, rm, lr, rr",
        "drawn widths and heights of the leg links",
    ),
    # S2 Table 1 is in one standing CAD frame: x to the side, y forward, z up. Trunk: (Jy, Jx, Jz).
    trunk=Trunk(
        mass=0.65, inertia=kg_mm2(2518.5, 16652.9, 16897.2), size=(0.495, 0.205, 0.089)
    ),
    coxa=Segment(
        mass=0.15, length=_COXA, com=_COXA / 2, inertia=kg_mm2(70.827, 108.377, 56.745),
        width=0.045, height=0.045, lower=-_TURN, upper=_TURN, effort=6.0, velocity=6.0,
    ),
    femur=Segment(
        mass=0.041, length=_FEMUR, com=_FEMUR / 2, inertia=kg_mm2(20.188, 86.698, 100.265),
        width=0.045, height=0.020, lower=-_LIFT, upper=_LIFT, effort=6.0, velocity=6.0,
    ),
    # The tibia hangs along the CAD z axis; here x runs along it: (Jz, Jy, Jx).
    tibia=Segment(
        mass=0.11, length=_TIBIA, com=_TIBIA / 2, inertia=kg_mm2(20.777, 87.515, 98.446),
        width=0.030, height=0.020, lower=0.0, upper=radians(160), effort=6.0, velocity=6.0,
    ),
    hips=six_hips(0.2, 0.1025),
    foot_radius=0.010,
    posture=(0.0, 0.0, pi / 2),
    additional_mass=0.63146,
    additional_mass_placement="trunk",
)  # fmt: skip

ATHENA = Blueprint.from_dimensions(
    "athena_like",
    title="ATHENA-like hexapod: the robot of S1 as far as it is known, all numbers assumed",
    source="no dimension, mass or limit of ATHENA (S1) was found: a plausible set, all assumed",
    assumed=(
        "every length, mass, inertia, limit and hip position (bodies are solid boxes and rods)",
        "total mass 8.25 kg; motors of the 165 g, 10.6 N m, 30 rpm class",
        "foot sphere of radius 0.020 m",
        "standing posture: femur 20 deg up, tibia 80 deg below horizontal",
        "no joint damping",
    ),
    trunk=Trunk.solid(4.5, (0.40, 0.24, 0.10)),
    coxa=Segment.box(0.225, (0.06, 0.05, 0.05), (-_TURN, _TURN), effort=10.6, velocity=3.14),
    femur=Segment.box(0.25, (0.12, 0.045, 0.04), (-_LIFT, radians(60)), effort=10.6, velocity=3.14),
    tibia=Segment.rod(0.15, 0.20, 0.015, (radians(15), radians(150)), effort=10.6, velocity=3.14),
    hip_x=0.18,
    hip_y=0.12,
    foot_radius=0.020,
    posture=(0.0, radians(-20), radians(100)),
)

PAPER_ROBOTS = {"kharagpur": KHARAGPUR, "athena": ATHENA}
"""File name (without .urdf) -> table."""
