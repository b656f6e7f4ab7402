"""The built-in scenes have their own robots, and the hard cases have reference answers."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.robot.description.blueprint import Blueprint, Segment, six_hips
from hexapod_pin.robot.description.paper_robots import KHARAGPUR

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


DATA = Path(__file__).resolve().parents[1] / "data"
ROBOTS = ("bench19", "hexa_ref")


def robot_file(name: str) -> Path:
    """Return the path of a scene's URDF.

    Raises:
        UnknownNameError: no such robot.
    """
    if name not in ROBOTS:
        raise UnknownNameError("robot of the benchmark scenes", name, list(ROBOTS))
    return DATA / f"{name}.urdf"


def lowest_foot(robot: Robot, q: Array, normal: ArrayLike = (0.0, 0.0, 1.0)) -> float:
    """Return the height of the lowest foot point over the plane through 0 with this normal [m]."""
    import pinocchio as pin

    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    gaps = [
        float(np.asarray(normal) @ data.oMi[robot.model.getJointId(foot.joint)].act(foot.offset))
        - float(foot.radius)
        for foot in robot.feet
    ]
    return min(gaps)


def _segment(part: Segment) -> Segment:
    """Return a segment of S2 Table 1 with the joint that the speed comparison gives it."""
    joint: dict[str, Any] = {
        "lower": -3.0, "upper": 3.0, "effort": 20.0, "velocity": 20.0, "damping": 0.3,
    }  # fmt: skip
    return Segment(**{**part.model_dump(), **joint})


BENCH19 = Blueprint(
    name="bench19",
    title="Hexapod of S2 Table 1 as the engines of the speed comparison get it",
    source="S2 Table 1: masses, inertias, lengths of the 19 bodies, 2.456 kg in all",
    assumed=(
        "hips at the ends and the middle of the trunk: x = +0.2475, 0, -0.2475 m, y = +-0.1025 m",
        "centre of mass of every leg link at mid-link",
        "foot sphere of radius 0.010 m, centred on the end of the tibia",
        "the 0.631 kg that S2's total has beyond its table left out",
        "joint damping 0.3 N m s/rad; limits +-3 rad, 20 N m, 20 rad/s (never reached)",
        "drawn widths and heights of the leg links",
    ),
    trunk=KHARAGPUR.trunk,
    coxa=_segment(KHARAGPUR.coxa),
    femur=_segment(KHARAGPUR.femur),
    tibia=_segment(KHARAGPUR.tibia),
    hips=six_hips(0.2475, 0.1025),
    foot_radius=KHARAGPUR.foot_radius,
    posture=KHARAGPUR.posture,
)
"""`data/bench19.urdf` is `BENCH19.urdf()`; a test compares them."""


# The reference answers of the hard cases.

G = 9.81
"""[m/s^2]"""


@lru_cache(maxsize=1)
def references() -> dict[str, Any]:
    """Return the catalogue: by case its set-up, answers and tolerance, SI unless stated."""
    data: dict[str, Any] = json.loads((DATA / "hardcases.json").read_text(encoding="utf-8"))
    return data


def answers(case: str) -> dict[str, Any]:
    """Return the answers of the case whose name begins with this id and "_"."""
    [found] = [value for name, value in references().items() if name.startswith(f"{case}_")]
    ref: dict[str, Any] = found["ref"]
    return ref
