"""Robots of the hard cases: rigid bodies with feet, and linkages on a base too heavy to move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.servo import Servo
from hexapod_pin.ground.contact import Contact, KelvinVoigt, TanhCoulomb
from hexapod_pin.ground.contact.normal import NormalLaw
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.robot.state import State
from hexapod_pin.scene.scene import Scene

Vector = tuple[float, float, float]

ZERO_GAIN_SERVO = Servo(kp=0.0, kd=0.0, limited=False)
NO_JOINT_STOPS = JointStops(stiffness=0.0)
NO_FRICTION = TanhCoulomb(mu=0.0, slope=1.0)

ANCHOR_MASS = 1e12
"""Mass of a base that a linkage of some kilograms does not move [kg]."""

ANCHOR_RATE = 100.0
"""Rate of the springs under that base, sqrt(K/m) [rad/s]."""


@dataclass(frozen=True)
class ChainLink:
    """A link that turns about a joint on its parent.

    Attributes:
        mass: [kg].
        com: centre of mass in the link's axes [m].
        inertia: principal moments about it, along the link's axes [kg m^2].
        axis: joint axis.
        place: joint in the parent's axes [m].
    """

    mass: float
    com: Vector
    inertia: Vector
    axis: Vector = (0.0, 1.0, 0.0)
    place: Vector = (0.0, 0.0, 0.0)


def body(
    feet: Mapping[str, Vector], *, mass: float = 1.0, com: Vector = (0.0, 0.0, 0.0),
    inertia: Vector = (0.01, 0.01, 0.01), radius: float | None = None,
) -> Robot:  # fmt: skip
    """Return one rigid body with feet.

    Args:
        feet: name -> place in body axes [m].
        mass: [kg].
        com: centre of mass [m].
        inertia: principal moments about it [kg m^2].
        radius: of the foot spheres [m]; None: points.
    """
    return _load(_link("body", mass, com, inertia), feet, radius)


def particle(mass: float = 1.0) -> Robot:
    """Return a body whose only foot is a point at its centre of mass."""
    return body({"foot": (0.0, 0.0, 0.0)}, mass=mass)


def ball(radius: float, *, mass: float = 1.0, inertia: float = 0.01) -> Robot:
    """Return a body whose only foot is a sphere about its centre of mass."""
    return body({"foot": (0.0, 0.0, 0.0)}, mass=mass, inertia=(inertia,) * 3, radius=radius)


SIX_FEET_MASS = 3.08746
"""Of the body of HC15, HC17 and HC18 [kg]."""

SIX_FEET = {
    "L1": (0.2475, 0.16), "L2": (0.0, 0.19), "L3": (-0.2475, 0.16),
    "R1": (0.2475, -0.16), "R2": (0.0, -0.19), "R3": (-0.2475, -0.16),
}  # fmt: skip
"""Its feet [m], in the order of the robot's."""


def six_feet_body(
    com: Vector, depth: float, inertia: Vector, feet: Sequence[str] = tuple(SIX_FEET)
) -> Robot:
    """Return that body with these feet, `depth` below its origin [m]."""
    places = {name: (*SIX_FEET[name], -depth) for name in feet}
    return body(places, mass=SIX_FEET_MASS, com=com, inertia=inertia)


def anchored(links: Sequence[ChainLink]) -> Robot:
    """Return a chain of links on a base of `ANCHOR_MASS` with four feet 10 m from its middle."""
    far = 10.0
    moments = (ANCHOR_MASS * far**2,) * 3
    text = _link("anchor", ANCHOR_MASS, (0.0, 0.0, 0.0), moments)
    parent = "anchor"
    for k, link in enumerate(links):
        name = f"link{k}"
        text += _link(name, link.mass, link.com, link.inertia)
        text += (
            f'<joint name="joint{k}" type="revolute"><parent link="{parent}"/>'
            f'<child link="{name}"/><origin xyz="{_xyz(link.place)}"/>'
            f'<axis xyz="{_xyz(link.axis)}"/>'
            '<limit lower="-1e9" upper="1e9" effort="1e9" velocity="1e9"/></joint>'
        )
        parent = name
    corners = [(far, 0.0), (0.0, far), (-far, 0.0), (0.0, -far)]
    feet = {f"foot{k}": (x, y, 0.0) for k, (x, y) in enumerate(corners)}
    return _load(text, feet, None, base="anchor")


def anchored_scene(
    robot: Robot, angles: ArrayLike, rates: ArrayLike, *, gravity: float = 9.81
) -> tuple[Scene, State]:
    """Return a linkage whose base rests on four undamped springs in its static depth.

    What the linkage moves its base by is F/M = 1e-12 m/s^2 per newton; the weight of the links,
    which the depth leaves out, makes it ring with (m/M) g/rate^2 = 1e-15 m per kilogram.
    """
    stiffness = 0.25 * ANCHOR_MASS * ANCHOR_RATE**2
    normal = KelvinVoigt(stiffness=stiffness, damping=0.0)
    scene = Scene(
        robot, contact=Contact(normal=normal, friction=NO_FRICTION), servo=ZERO_GAIN_SERVO,
        gravity=(0.0, 0.0, -gravity), stops=NO_JOINT_STOPS,
    )  # fmt: skip
    return scene, state(robot, (0.0, 0.0, -gravity / ANCHOR_RATE**2), joints=angles, rates=rates)


def on_ground(robot: Robot, normal: NormalLaw, **parts: Any) -> Scene:
    """Return a passive scene; `parts` are friction (none by default) and fields of `Scene`."""
    contact = Contact.model_construct(
        normal=normal, friction=parts.pop("friction", NO_FRICTION), assumed=""
    )
    return Scene(robot, contact=contact, servo=ZERO_GAIN_SERVO, stops=NO_JOINT_STOPS, **parts)


def state(
    robot: Robot, place: ArrayLike = (0.0, 0.0, 0.0), velocity: ArrayLike = (0.0, 0.0, 0.0),
    *, spin: ArrayLike = (0.0, 0.0, 0.0), joints: ArrayLike = (), rates: ArrayLike = (),
) -> State:  # fmt: skip
    """Return a level state; places in m, velocities in m/s, joints and spins in rad and rad/s."""
    angles = np.asarray(joints, dtype=float)
    n = len(robot.joint_names)
    q = np.concatenate([np.asarray(place, float), [0.0, 0.0, 0.0, 1.0], np.resize(angles, n)])
    v = np.concatenate([np.asarray(velocity, float), np.asarray(spin, float), np.resize(rates, n)])
    return robot.check_state(q, v)


def _load(
    text: str, feet: Mapping[str, Vector], radius: float | None, *, base: str = "body"
) -> Robot:
    for name, place in feet.items():
        text += (
            f'<link name="{name}"/><joint name="{name}_fix" type="fixed"><parent link="{base}"/>'
            f'<child link="{name}"/><origin xyz="{_xyz(place)}"/></joint>'
        )
    with TemporaryDirectory() as folder:
        path = Path(folder) / "body.urdf"
        path.write_text(f'<robot name="{base}">{text}</robot>', encoding="utf-8")
        return load_robot(path, feet=list(feet), foot_radius=radius)


def _link(name: str, mass: float, com: Vector, inertia: Vector) -> str:
    ixx, iyy, izz = inertia
    return (
        f'<link name="{name}"><inertial><origin xyz="{_xyz(com)}"/><mass value="{mass!r}"/>'
        f'<inertia ixx="{ixx!r}" iyy="{iyy!r}" izz="{izz!r}" ixy="0" ixz="0" iyz="0"/>'
        "</inertial></link>"
    )


def _xyz(vector: Vector) -> str:
    return " ".join(repr(float(x)) for x in vector)
