"""What joints must hold while a robot stands still on some of its feet: static equilibrium.

Feet push along gravity, without friction. More than three feet leave their shares open: taken is
the distribution of least norm that pulls on no foot (Lawson & Hanson 1974, chapter 23: least
distance programming by non-negative least squares).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array

if TYPE_CHECKING:
    import pinocchio as pin

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
        x, y, z = _cross(arm, up)  # up . (v + w x arm) = up . v + w . (arm x up)
        row[:] = up @ jacobian[:3] + jacobian[3] * x + jacobian[4] * y + jacobian[5] * z
    return weight, rows


def _cross(a: Array, b: Array) -> tuple[float, float, float]:
    """Return a x b of single vectors, many times quicker than NumPy's for stacks of them."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


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
    from scipy.optimize import nnls

    _, singular, right = np.linalg.svd(balance)
    rank = int(np.sum(singular > 1e-10 * singular[0]))
    free = right[rank:].T  # share + free z balances for any z; least |z| so that all are >= 0
    if not free.shape[1]:
        return None
    system, target = np.vstack([free.T, -share]), np.zeros(free.shape[1] + 1)
    target[-1] = 1.0
    left = system @ nnls(system, target)[0] - target
    if abs(left[-1]) < UNBALANCED:
        return None
    found = np.asarray(share - free @ (left[:-1] / left[-1]))
    return np.maximum(found, 0.0) if found.min() >= -UNBALANCED else None
