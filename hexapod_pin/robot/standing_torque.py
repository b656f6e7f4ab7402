"""What the joints must hold while the robot stands still on few feet: its weight, statically."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.robot.holding_torque import PULLED, static_terms
from hexapod_pin.robot.once_per_robot import once_per_robot
from hexapod_pin.robot.scratch_data import scratch_data

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

STANDARD_GRAVITY = 9.81
"""Acceleration with which loads are stated [m/s^2]."""

SUPPORT = 3
"""Fewest feet that carry a robot at rest."""


@once_per_robot
def standing_torque(robot: Robot) -> Array:
    """Return the largest static torque of each joint on the fewest feet (n,) [N m; prismatic: N].

    The robot stands level in its posture; feet push vertically, without friction. Six legs (and
    any even number above) stand on every other foot around the trunk; others, and where these do
    not hold the centre of mass, on each three feet that do, or else on all. Joints that carry
    nothing but themselves are counted too. Zero of a robot without three feet.
    """
    model, data, q = robot.model, scratch_data(robot), robot.stand().q
    scale = STANDARD_GRAVITY / float(np.linalg.norm(model.gravity.linear))
    feet = [(model.getJointId(foot.joint), foot.offset) for foot in robot.feet]
    gravity, rows = static_terms(model, data, feet, q)
    weight = scale * gravity
    found = [_torque(rows[list(feet)], weight) for feet in _stances(robot, data, rows, weight)]
    return read_only(np.max(np.abs(found), axis=0) if found else np.zeros(model.nv - 6))


def _forces(rows: Array, weight: Array) -> Array:
    """Return the vertical foot forces of least squares that balance the base (F,) [N]."""
    return np.asarray(np.linalg.lstsq(rows[:, :6].T, weight[:6], rcond=None)[0])


def _torque(rows: Array, weight: Array) -> Array:
    return np.asarray(weight[6:] - rows[:, 6:].T @ _forces(rows, weight))


def _stances(robot: Robot, data: object, rows: Array, weight: Array) -> Iterator[tuple[int, ...]]:
    """Yield sets of feet that carry the robot without being pulled."""
    import pinocchio as pin

    count = len(robot.feet)
    if count < SUPPORT:
        return
    center = pin.centerOfMass(robot.model, data, robot.stand().q)[:2]
    place = np.array(
        [data.oMi[robot.model.getJointId(f.joint)].act(f.offset)[:2] for f in robot.feet]  # type: ignore[attr-defined]
    )
    around = np.argsort(np.arctan2(*(place - center).T[::-1]), kind="stable").tolist()
    alternate = [tuple(around[0::2]), tuple(around[1::2])]
    total = float(np.linalg.norm(weight[:3]))

    def carries(feet: tuple[int, ...]) -> bool:
        force = _forces(rows[list(feet)], weight)
        left = rows[list(feet), :6].T @ force - weight[:6]
        return bool(force.min() >= PULLED * total and np.abs(left).max() <= 1e-6 * total)

    if count >= 2 * SUPPORT and count % 2 == 0 and all(carries(feet) for feet in alternate):
        yield from alternate
        return
    found = [feet for feet in itertools.combinations(range(count), SUPPORT) if carries(feet)]
    yield from found or [tuple(range(count))]
