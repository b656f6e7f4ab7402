"""The native law is linearised by differences about a standing robot.

The closed loop from tick to tick is one matrix.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.control.foot_control.law import TARGET_SIZE
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.robot.rotations import skew

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
    """m' = F m + G y, command u = H m + L y: one tick of foot control about standing.

    A command is the set-points at its end, then their rates there times the period. The feet's
    targets have gone through the inverse kinematics' Jacobian. Numbers that readings do not reach,
    or that do not reach the command, are left out of the memory m.

    Attributes:
        memory: F. Shape (m, m).
        reading: G. Shape (m, Y).
        set_point: H. Shape (2n, m).
        through: L. Shape (2n, Y).
        fields: of `Measurement` that the law reads; y has them one behind the other.
    """

    memory: Array
    reading: Array
    set_point: Array
    through: Array
    fields: tuple[str, ...]

    @classmethod
    def of(
        cls, law: FootControlLaw, scene: Any, stance: StanceModel, period: float, share: float = 1.0
    ) -> LinearLaw:
        """Return the linear law.

        Args:
            law: of the native core, with limits that are far.
            scene: whose robot stands.
            stance: its static forces; feet without load are planned to swing.
            period: between ticks [s].
            share: of the targets' tangential forces that the feet have [-].
        """
        six = leg_group(scene.robot)
        table = _standing_plan(six.neutral_feet, _loads_by_leg(scene, stance) > 0.0)
        point = _readings(scene, stance)
        settled = law.first_memory()[None]
        for _ in range(3):  # until its flags have settled
            settled = _tick(law, table, {k: value[None] for k, value in point.items()}, settled)[1]
            aimed = share * law.targets(settled[0])[_legs_of_feet(scene)] * [1.0, 1.0, 0.0]
            point = _readings(scene, stance, aimed)
        sizes = {name: 3 if name == "rotation" else part.size for name, part in point.items()}
        count, width = settled.size, sum(sizes.values())
        nudges = NUDGE * np.eye(count + width)
        targets, memory = (
            (ahead - behind) / (2.0 * NUDGE)
            for ahead, behind in zip(
                *(_nudged(law, table, point, settled, sign * nudges) for sign in (1.0, -1.0)),
                strict=True,
            )
        )
        joints = _to_joints(scene, targets, period)
        return _reduced(memory.T, joints.T, count, sizes)

    @property
    def size(self) -> int:
        """Numbers in the memory."""
        return len(self.memory)


def _legs_of_feet(scene: Any) -> list[int]:
    """Return the place of each foot's leg among the legs in gait order."""
    feet = [scene.robot.leg(leg.name).foot for leg in leg_group(scene.robot).legs]
    return [feet.index(foot.name) for foot in scene.robot.feet]


def _loads_by_leg(scene: Any, stance: StanceModel) -> Array:
    names = [foot.name for foot in scene.robot.feet]
    legs = leg_group(scene.robot).legs
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


def _readings(scene: Any, stance: StanceModel, aside: Array | float = 0.0) -> dict[str, Array]:
    """Return the readings of a standing robot, a row; `aside`: tangential forces (F, 3) [N]."""
    robot, none = scene.robot, np.zeros(len(scene.robot.joint_names))
    up = np.array([0.0, 0.0, 1.0])
    sideways = np.zeros((len(robot.feet), 3)) + aside
    torque = stance.torque - np.einsum("fkn,fk->n", stance.jacobian[:, :, 6:], sideways)
    values = (
        robot.posture, none, torque, np.eye(3), np.zeros(3), stance.gravity * up,
        stance.load[:, None] * up + sideways,
    )  # fmt: skip
    return dict(zip(READINGS, map(np.asarray, values), strict=True))


def _tick(
    law: FootControlLaw, table: WalkTable, point: dict[str, Array], memory: Array
) -> tuple[Array, Array]:
    """Return targets (B, 6, `TARGET_SIZE`) and memories (B, N) after a tick; rows of readings."""
    targets, after = np.empty((len(memory), 6, TARGET_SIZE)), np.empty_like(memory)
    update: Any = law.update
    update(table, 0.0, *map(np.ascontiguousarray, point.values()), memory, after, targets)
    return targets, after


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
            moved[name] = value @ (np.eye(3) + skew(step))
        else:
            moved[name] = value + step.reshape(rows, *value.shape)
        at += size
    return _tick(law, table, moved, settled + nudges[:, :count])


def _to_joints(scene: Any, targets: Array, period: float) -> Array:
    """Return commands (K, 2n) of small motions of targets (K, 6, 12): angles, then rates."""
    six = leg_group(scene.robot)
    jacobian = six.kinematics.jacobian(six.kinematics.posture[:, None])[:, 0]
    parts = targets.reshape(len(targets), 6, 2, 2, 3) * np.array([[1.0], [period]])
    angles = np.einsum("lij,kldj->kdli", np.linalg.inv(jacobian), parts[:, :, 0])
    angles += np.swapaxes(parts[:, :, 1], 1, 2)
    joints = np.zeros((len(targets), 2, len(scene.robot.joint_names)))
    joints[:, :, six.joint_index] = angles
    return joints.reshape(len(targets), -1)


def _reduced(memory: Array, joints: Array, count: int, sizes: dict[str, int]) -> LinearLaw:
    """Leave out readings and numbers of the memory without influence."""
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


# The closed loop of foot control and a standing robot from tick to tick, as one matrix.

NEUTRAL = 1e-6
"""An eigenvalue nearer to 1 than this is one: integrals that no reading reaches, a trunk that no
spring holds over creeping feet. At 200 Hz what grows slower takes 5000 s to grow by e."""

SAME_RANK = 1e-8
"""Singular values of the set-points' directions below this share of the largest are rounding."""

SAME_TIME = 1e-9
"""Share of a period by which a delay may miss a tick and still be at it."""


@dataclass(frozen=True, eq=False)
class LinearLoop:
    """A standing robot between ticks, set-points on cubics; sensor and command delay in one.

    Only their sum matters to a loop whose plan stands. A delay of n ticks and a part r of one is
    exact: what is read at t - d, within a tick, acts n + 1 ticks after that tick.

    Attributes:
        stance: the robot.
        period: between ticks [s].
        delay: from a measurement until its command acts [s].
        whole: (x, v, q_ref and its first three derivatives) at the end of a tick by those at its
            begin. Shape (S, S).
        part: the same up to the time of measurement in the tick.
        waits: ticks between the tick of a measurement and that of its command.
    """

    stance: StanceModel
    period: float
    delay: float
    whole: Array
    part: Array
    waits: int

    @classmethod
    def of(cls, stance: StanceModel, period: float, delay: float) -> LinearLoop:
        """Discretise a stance, exactly for set-points on cubics."""
        ticks = math.floor(delay / period + SAME_TIME)
        rest = max(0.0, delay - ticks * period)
        states, joints = 2 * stance.size, len(stance.kp)
        rates = np.zeros((states + 4 * joints,) * 2)
        rates[:states, : states + 2 * joints] = np.hstack(
            [stance.state_matrix, stance.input_matrix]
        )
        rates[states:-joints, states + joints :] = np.eye(3 * joints)
        from scipy.linalg import expm

        whole = expm(period * rates)
        at_tick = rest <= SAME_TIME * period
        part = whole if at_tick else expm((period - rest) * rates)
        return cls(stance, period, delay, whole, part, ticks + 1)

    def matrix(self, law: LinearLaw) -> Array:
        """Return the closed loop from tick to tick.

        State: x and v of the robot, then along the directions that the law uses the command whose
        end is now and the delayed ones, oldest first, then the memory.
        """
        basis = _directions(np.hstack([law.set_point, law.through]))
        whole, part = self._along(self.whole, basis), self._along(self.part, basis)
        states, rank = 2 * self.stance.size, basis.shape[1]
        queue = slice(states + rank, states + rank * (1 + self.waits))
        begin = queue.stop
        size = begin + law.size
        reading = np.zeros((law.reading.shape[1], size))
        reading[:, : states + 2 * rank] = self._reading(law, part)
        found = np.zeros((size, size))
        found[:states, : states + 2 * rank] = whole[:states]
        found[states : queue.stop - rank, states + rank : queue.stop] = np.eye(rank * self.waits)
        last = slice(queue.stop - rank, queue.stop)
        found[last] = basis.T @ law.through @ reading
        found[last, begin:] += basis.T @ law.set_point
        found[begin:] = law.reading @ reading
        found[begin:, begin:] += law.memory
        return found

    def _along(self, motion: Array, basis: Array) -> Array:
        """Return what `motion` does by (x, v, command that ends now, that of the tick's end)."""
        states, rank = 2 * self.stance.size, basis.shape[1]
        begin = np.zeros((len(motion), states + 2 * rank))
        begin[:states, :states] = np.eye(states)
        # derivatives of the cubic at its begin, by angles and rates times the period of both ends
        cubic = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [-6, -4, 6, -2], [12, 6, -12, 6]])
        scaled = cubic / self.period ** np.arange(4)[:, None]
        ends = np.kron(np.eye(2), basis)  # (angles, rates; begin, then end) by directions
        ends = ends.reshape(4, len(basis) // 2, 2 * rank)
        derivatives = np.einsum("de,ejr->djr", scaled, ends)
        begin[states:, states:] = derivatives.reshape(len(motion) - states, 2 * rank)
        return motion @ begin

    def _reading(self, law: LinearLaw, part: Array) -> Array:
        """Return the readings of a tick by its state, with the commands it begins and ends at."""
        outputs = self.stance.outputs()
        rows = [np.hstack(outputs[name]) for name in law.fields]
        seen = part[: 2 * self.stance.size + 2 * len(self.stance.kp)]
        joined = np.vstack(rows) if rows else np.zeros((0, len(seen)))
        return np.asarray(joined @ seen)

    def radius(self, law: LinearLaw, drift_time: float = math.inf) -> float:
        """Return the largest |eigenvalue| of the loop, neutral ones aside; below 1: stable.

        Args:
            law: the controller.
            drift_time: what neither grows by e nor turns by 1 rad in this time is neutral [s].
        """
        eigenvalues = np.linalg.eigvals(self.matrix(law))
        away, size = np.abs(eigenvalues - 1.0), np.abs(eigenvalues)
        least = math.expm1(self.period / drift_time)  # two drifts alike may be a pair: no swing
        neutral = (away < NEUTRAL) | (away < least) & (size > 1.0 - NEUTRAL)
        return float(size[~neutral].max(initial=0.0))


def _directions(columns: Array) -> Array:
    """Return an orthonormal basis of what columns span. Shape (n, rank)."""
    size = np.linalg.norm(columns, axis=0)
    unit = columns[:, size > 0.0] / size[size > 0.0]
    if not unit.size:
        return np.zeros((len(columns), 0))
    left, values, _ = np.linalg.svd(unit, full_matrices=False)
    return np.asarray(left[:, values > SAME_RANK * values[0]])
