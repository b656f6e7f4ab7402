"""Foot control made linear: the native law itself, differenced about a standing robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.control.six_legs import six_legs

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.control.foot_control.stance_model import StanceModel
    from hexapod_pin.native import FootControlLaw, WalkTable

NUDGE = 1e-5
"""Of a central difference, in the unit of each number: the law has products of two, no more."""

CYCLE = 1e6
"""Of the plan that stands; far from its ends no load is being taken up or given back [s]."""

READINGS = ("q", "v", "torque", "rotation", "angular_velocity", "acceleration", "foot_force")
"""In the order of the native law."""


@dataclass(frozen=True, eq=False)
class LinearLaw:
    """m' = F m + G y, set-points u = H m + L y: one tick of foot control about standing.

    The feet's targets have gone through the inverse kinematics' Jacobian. Numbers that readings do
    not reach, or that do not reach the set-points, are left out of the memory m.

    Attributes:
        memory: F. Shape (m, m).
        reading: G. Shape (m, Y).
        set_point: H. Shape (n, m).
        through: L. Shape (n, Y).
        fields: of `Measurement` that the law reads; y has them one behind the other.
    """

    memory: Array
    reading: Array
    set_point: Array
    through: Array
    fields: tuple[str, ...]

    @classmethod
    def of(cls, law: FootControlLaw, scene: Any, stance: StanceModel) -> LinearLaw:
        """Return the linear law.

        Args:
            law: of the native core, with limits that are far.
            scene: whose robot stands.
            stance: its static forces; feet without load are planned to swing.
        """
        six = six_legs(scene.robot)
        table = _standing_plan(six.neutral_feet, _loads_by_leg(scene, stance) > 0.0)
        point = _readings(scene, stance)
        settled = law.first_memory()[None]
        for _ in range(3):  # until its flags have settled
            settled = _tick(law, table, {k: value[None] for k, value in point.items()}, settled)[1]
        sizes = {name: 3 if name == "rotation" else part.size for name, part in point.items()}
        count, width = settled.size, sum(sizes.values())
        nudges = NUDGE * np.eye(count + width)
        feet, memory = (
            (ahead - behind) / (2.0 * NUDGE)
            for ahead, behind in zip(
                *(_nudged(law, table, point, settled, sign * nudges) for sign in (1.0, -1.0)),
                strict=True,
            )
        )
        joints = _to_joints(scene, feet)
        return _reduced(memory.T, joints.T, count, sizes)

    @property
    def size(self) -> int:
        """Numbers in the memory."""
        return len(self.memory)


def _loads_by_leg(scene: Any, stance: StanceModel) -> Array:
    names = [foot.name for foot in scene.robot.feet]
    legs = six_legs(scene.robot).legs
    return np.array([stance.load[names.index(scene.robot.leg(leg.name).foot)] for leg in legs])


def _standing_plan(feet: Array, stands: NDArray[np.bool_]) -> WalkTable:
    """Return a plan in which some feet stand for ever and the others are half through a swing."""
    from hexapod_pin.native import WalkTable

    phases = [0.75 if down else 0.25 for down in stands]  # duty 1/2: ages of 0.25 and 0.75
    table = WalkTable(phases, 0.5, CYCLE, CYCLE, -1.0)
    rows = np.tile(feet, (3, 1, 1))
    still = np.tile(stands, (3, 1))
    table.append(rows, np.zeros_like(rows), np.ascontiguousarray(still), np.zeros((3, 3)))
    return table


def _readings(scene: Any, stance: StanceModel) -> dict[str, Array]:
    """Return what a standing robot reads, a row."""
    robot, none = scene.robot, np.zeros(len(scene.robot.joint_names))
    up = np.array([0.0, 0.0, 1.0])
    values = (
        robot.posture, none, stance.torque, np.eye(3), np.zeros(3), stance.gravity * up,
        stance.load[:, None] * up,
    )  # fmt: skip
    return dict(zip(READINGS, map(np.asarray, values), strict=True))


def _tick(
    law: FootControlLaw, table: WalkTable, point: dict[str, Array], memory: Array
) -> tuple[Array, Array]:
    """Return targets of the feet (B, 6, 3) and memories (B, N) after a tick; rows of readings."""
    feet, after = np.empty((len(memory), 6, 3)), np.empty_like(memory)
    update: Any = law.update
    update(table, 0.0, *map(np.ascontiguousarray, point.values()), memory, after, feet)
    return feet, after


def _nudged(
    law: FootControlLaw, table: WalkTable, point: dict[str, Array], settled: Array, nudges: Array
) -> tuple[Array, Array]:
    """Return targets and memories after ticks with each number nudged; memory first, readings."""
    count, rows = settled.size, len(nudges)
    at, moved = count, {}
    for name, value in point.items():
        size = 3 if name == "rotation" else value.size
        step = nudges[:, at : at + size]
        if name == "rotation":
            moved[name] = value @ (np.eye(3) + _crosses(step))
        else:
            moved[name] = value + step.reshape(rows, *value.shape)
        at += size
    return _tick(law, table, moved, settled + nudges[:, :count])


def _crosses(vectors: Array) -> Array:
    """Return the matrices of the cross products with vectors (K, 3). Shape (K, 3, 3)."""
    x, y, z = vectors.T
    none = np.zeros_like(x)
    return np.moveaxis(np.array([[none, -z, y], [z, none, -x], [-y, x, none]]), 2, 0)


def _to_joints(scene: Any, feet: Array) -> Array:
    """Return the joint angles (K, n) of small motions of the feet (K, 6, 3)."""
    six = six_legs(scene.robot)
    jacobian = six.kinematics.jacobian(six.kinematics.posture[:, None])[:, 0]
    angles = np.einsum("lij,klj->kli", np.linalg.inv(jacobian), feet)
    joints = np.zeros((len(feet), len(scene.robot.joint_names)))
    joints[:, six.joint_index] = angles
    return joints


def _reduced(memory: Array, joints: Array, count: int, sizes: dict[str, int]) -> LinearLaw:
    """Leave out what is not read, and numbers of the memory that take no part.

    Args:
        memory: change of the memory by memory and readings.
        joints: the same of the set-points.
        count: numbers of the memory.
        sizes: of the readings.
    """
    within, entering = memory[:, :count] != 0.0, memory[:, count:] != 0.0
    reached, seen = entering.any(axis=1), (joints[:, :count] != 0.0).any(axis=0)
    for _ in range(count):
        before = reached.sum() + seen.sum()
        reached |= within[:, reached].any(axis=1)
        seen |= within[seen].any(axis=0)
        if reached.sum() + seen.sum() == before:
            break
    kept = np.flatnonzero(reached & seen)
    ends = count + np.cumsum([0, *sizes.values()])
    fields: list[str] = []
    read: list[int] = []
    for name, begin, end in zip(sizes, ends, ends[1:], strict=False):
        if memory[kept, begin:end].any() or joints[:, begin:end].any():
            fields.append(name)
            read.extend(range(begin, end))
    return LinearLaw(
        memory[np.ix_(kept, kept)], memory[kept][:, np.array(read, dtype=int)], joints[:, kept],
        joints[:, np.array(read, dtype=int)], tuple(fields),
    )  # fmt: skip
