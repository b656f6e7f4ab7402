"""Robots that are cheap to evaluate: a body with one foot or three, and a trunk on one leg."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.validation.cases.bodies import body

FOOT_RADIUS = 0.01
"""[m]"""

TRUNK, FEMUR, TIBIA = 0.03, 0.08, 0.10
"""Places of the joints along the leg [m]."""


@lru_cache
def puck() -> Robot:
    """Return a body of 0.3 kg on one foot that is not below its centre of mass."""
    feet = {"foot": (0.01, 0.005, -0.02)}
    return body(feet, mass=0.3, inertia=(2e-4, 3e-4, 4e-4), radius=FOOT_RADIUS)


@lru_cache
def stool() -> Robot:
    """Return a body of 1 kg on three feet."""
    feet = {"a": (0.1, 0.05, -0.05), "b": (-0.1, 0.05, -0.05), "c": (0.0, -0.1, -0.05)}
    return body(feet, inertia=(0.004, 0.005, 0.007), radius=FOOT_RADIUS)


@lru_cache
def monopod(*, dry: float = 0.0, effort: float = 3.0) -> Robot:
    """Return a trunk of 1 kg on a leg of three joints, 1 rad wide to each side.

    Args:
        dry: level of the joints' dry friction [N m].
        effort: largest torques [N m].
    """
    text = _link("trunk", 1.0, (0.0, 0.0, 0.0), (3e-3, 4e-3, 5e-3))
    parts = (
        ("coxa", "0 0 1", (0.0, 0.0, 0.0), 0.10, TRUNK),
        ("femur", "0 1 0", (TRUNK, 0.0, 0.0), 0.08, FEMUR),
        ("tibia", "0 1 0", (FEMUR, 0.0, 0.0), 0.06, TIBIA),
    )
    parent = "trunk"
    for name, axis, place, mass, reach in parts:
        moment = mass * reach**2 / 12.0
        text += _link(name, mass, (0.5 * reach, 0.0, 0.0), (0.3 * moment, moment, moment))
        text += (
            f'<joint name="{name}_joint" type="revolute"><parent link="{parent}"/>'
            f'<child link="{name}"/><origin xyz="{_xyz(place)}"/><axis xyz="{axis}"/>'
            f'<limit lower="-1" upper="1" effort="{effort!r}" velocity="10"/>'
            f'<dynamics damping="0.002" friction="{dry!r}"/></joint>'
        )
        parent = name
    text += (
        '<link name="foot"/><joint name="foot_fix" type="fixed"><parent link="tibia"/>'
        f'<child link="foot"/><origin xyz="{TIBIA} 0 0"/></joint>'
    )
    with TemporaryDirectory() as folder:
        path = Path(folder) / "monopod.urdf"
        path.write_text(f'<robot name="monopod">{text}</robot>', encoding="utf-8")
        return load_robot(path, feet=["foot"], foot_radius=FOOT_RADIUS)


def _link(
    name: str, mass: float, com: tuple[float, ...], moments: tuple[float, float, float]
) -> str:
    xx, yy, zz = moments
    return (
        f'<link name="{name}"><inertial><origin xyz="{_xyz(com)}"/><mass value="{mass!r}"/>'
        f'<inertia ixx="{xx!r}" iyy="{yy!r}" izz="{zz!r}" ixy="0" ixz="0" iyz="0"/>'
        "</inertial></link>"
    )


def _xyz(vector: tuple[float, ...]) -> str:
    return " ".join(repr(float(x)) for x in vector)
