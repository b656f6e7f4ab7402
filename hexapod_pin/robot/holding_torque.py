"""Joint torques hold a robot still on some of its feet, by static equilibrium.

Feet push along gravity, without friction. More than three feet leave their shares open: taken is
the distribution of least norm that pulls on no foot (Lawson & Hanson 1974, chapter 23: least
distance programming by non-negative least squares).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.robot.robot import once_per_robot, scratch_data
from hexapod_pin.robot.rotations import cross

if TYPE_CHECKING:
    import pinocchio as pin

    from hexapod_pin.robot.robot import Robot


PULLED = -1e-9
"""Least foot force, over the weight, that counts as pushing: rounding."""

UNBALANCED = 1e-6
"""Largest force and moment left, over the weight [-, m], that count as balance."""


class Holding(NamedTuple):
    """Static equilibria of K postures on S supports each.

    Attributes:
        torque: of the joints [N m; prismatic: N]; NaN where the support cannot hold (K, S, n).
        force: of the feet, upwards [N]; NaN where the support cannot hold (K, S, F).
    """

    torque: Array
    force: Array

    @property
    def holds(self) -> NDArray[np.bool_]:
        """Whether the feet of the support carry the robot without being pulled. Shape (K, S)."""
        return np.asarray(np.isfinite(self.force).all(axis=-1), dtype=np.bool_)


def holding_torque(
    model: pin.Model, feet: Sequence[tuple[int, Array]], q: Array, supports: NDArray[np.bool_]
) -> Holding:
    """Return what the joints hold, and the feet carry, in postures at rest.

    Args:
        model: with free-flyer and the gravity of the place.
        feet: joint that moves a foot, and the foot in its frame [m] (3,); F of them.
        q: postures. Shape (K, nq).
        supports: which feet stand. Shape (K, S, F).
    """
    data = model.createData()
    torque = np.full((*supports.shape[:2], model.nv - 6), np.nan)
    force = np.full(supports.shape, np.nan)
    for k, posture in enumerate(q):
        weight, rows = static_terms(model, data, feet, posture)
        seen: dict[bytes, int] = {}
        for s, stands in enumerate(supports[k]):
            twin = seen.setdefault(stands.tobytes(), s)
            if twin < s:
                force[k, s], torque[k, s] = force[k, twin], torque[k, twin]
                continue
            found = foot_forces(rows[stands], weight)
            if found is not None:
                force[k, s] = 0.0
                force[k, s, stands] = found
                torque[k, s] = weight[6:] - rows[stands, 6:].T @ found
    return Holding(torque, force)


def static_terms(
    model: pin.Model, data: Any, feet: Sequence[tuple[int, Array]], q: Array
) -> tuple[Array, Array]:
    """Return generalised gravity (nv,), and by the velocity how fast each foot rises (F, nv)."""
    import pinocchio as pin

    weight = np.array(pin.computeGeneralizedGravity(model, data, q))
    pin.computeJointJacobians(model, data, q)
    gravity = np.array(model.gravity.linear)
    up = -gravity / np.linalg.norm(gravity)
    rows = np.empty((len(feet), model.nv))
    world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    for row, (joint, offset) in zip(rows, feet, strict=True):
        jacobian = pin.getJointJacobian(model, data, joint, world)
        arm = data.oMi[joint].rotation @ offset
        x, y, z = cross(arm, up)  # up . (v + w x arm) = up . v + w . (arm x up)
        row[:] = up @ jacobian[:3] + jacobian[3] * x + jacobian[4] * y + jacobian[5] * z
    return weight, rows


def foot_forces(rows: Array, weight: Array) -> Array | None:
    """Return the foot forces of least norm that balance the base without a pull.

    Args:
        rows: of the feet that stand (S, nv), as of `static_terms`.
        weight: generalised gravity (nv,).

    Returns:
        Shape (S,) [N]; None where there are none: the robot would tip over.
    """
    balance, load = rows[:, :6].T, weight[:6] / np.linalg.norm(weight[:3])
    total = float(np.linalg.norm(weight[:3]))
    if not rows.shape[0]:
        return None
    share = np.asarray(np.linalg.lstsq(balance, load, rcond=None)[0])
    if np.abs(balance @ share - load).max() > UNBALANCED:
        return None
    found = share if share.min() >= PULLED else _without_pull(balance, share)
    return None if found is None else np.asarray(total * found)


def _without_pull(balance: Array, share: Array) -> Array | None:
    """Return the shares of least norm that are >= 0, from those of least norm of either sign."""
    _, singular, right = np.linalg.svd(balance)
    rank = int(np.sum(singular > 1e-10 * singular[0]))
    free = right[rank:].T  # share + free z balances for any z; least |z| so that all are >= 0
    if not free.shape[1]:
        return None
    system, target = np.vstack([free.T, -share]), np.zeros(free.shape[1] + 1)
    target[-1] = 1.0
    left = system @ non_negative_least_squares(system, target) - target
    if abs(left[-1]) < UNBALANCED:
        return None
    found = np.asarray(share - free @ (left[:-1] / left[-1]))
    return np.maximum(found, 0.0) if found.min() >= -UNBALANCED else None


ROUNDING = 1e-12
"""Slope of the error, over its size, that counts as none."""


def non_negative_least_squares(matrix: Array, target: Array) -> Array:
    """Return x >= 0 of least |matrix x - target|, by the active sets of Lawson and Hanson.

    For the few columns of a robot's feet; SciPy's takes a third of a walk's time to import.

    Args:
        matrix: of M rows and N columns. Shape (M, N).
        target: shape (M,).

    Returns:
        Shape (N,).
    """
    count = matrix.shape[1]
    x, used = np.zeros(count), np.zeros(count, dtype=bool)
    least = ROUNDING * float(np.abs(matrix).max() * np.linalg.norm(target) or 1.0)
    for _ in range(3 * count):
        slope = matrix.T @ (target - matrix @ x)
        slope[used] = -np.inf
        best = int(np.argmax(slope))
        if used.all() or slope[best] <= least:
            break
        used[best] = True
        while True:
            new = np.zeros(count)
            new[used] = np.linalg.lstsq(matrix[:, used], target, rcond=None)[0]
            below = used & (new <= 0.0)
            if not below.any():
                break
            share = float((x[below] / (x[below] - new[below])).min())
            x += share * (new - x)
            used &= x > ROUNDING * max(1.0, float(np.abs(x).max()))
            x[~used] = 0.0
        x = new
    return x


# What the joints must hold while the robot stands still on few feet: its weight, statically.

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
