"""A stance is a linear problem in the foot forces (S2 appendix, eqs. 1-2).

For locked joints the feet may stand on springs.

    J_b^T f = w                 six equations: the base has the given acceleration
    tau = tau_0 - J_j^T f       the torques that go with f

With k feet f has 3k components: from three feet on it is not unique, and a split chooses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.formulations.rigid.model import RigidModel
from hexapod_pin.formulations.truncated_svd import pseudo_inverse

UNIQUE_NULL_SPACE_PART = 1e-9
"""A force component with a larger part than this in the null space is not unique [-]."""


@dataclass(frozen=True)
class StanceLoad:
    """The balance of one stance; k feet, n joints.

    Attributes:
        feet: indices of the grounded feet.
        base_rows: J_b, velocity of the contact points per base twist (body axes). Shape (3k, 6).
        joint_rows: J_j, the same per joint rate. Shape (3k, n).
        wrench: w, what the feet must give to the base, body axes [N, N m]. Shape (6,).
        free_torque: tau_0, torques with unloaded feet [N m]. Shape (n,).
        normal: of the ground. Shape (3,).
        mu: coefficient of friction [-].
        effort: largest torques [N m]. Shape (n,).
    """

    feet: tuple[int, ...]
    base_rows: Array
    joint_rows: Array
    wrench: Array
    free_torque: Array
    normal: Array
    mu: float
    effort: Array

    def torque(self, force: Array) -> Array:
        """Return the torques (n,) that go with the foot forces (3k,)."""
        return self.free_torque - self.joint_rows.T @ force

    def imbalance(self, force: Array) -> Array:
        """Return what foot forces (3k,) leave of the base's balance, body axes (6,) [N, N m]."""
        return self.base_rows.T @ force - self.wrench

    @property
    def unique(self) -> NDArray[np.bool_]:
        """Whether the balance alone determines each force component. Shape (3k,)."""
        _, null = pseudo_inverse(self.base_rows.T)
        return np.asarray(np.linalg.norm(null, axis=1) < UNIQUE_NULL_SPACE_PART)


def stance_load(
    model: RigidModel, q: Array, v: Array, acceleration: Array, feet: Sequence[int]
) -> StanceLoad:
    """Return the balance of a robot that moves with this acceleration on these feet.

    Args:
        model: robot and ground.
        q: configuration. Shape (nq,).
        v: velocity. Shape (nv,).
        acceleration: of base (body axes) and joints [m/s^2, rad/s^2]. Shape (nv,).
        feet: indices of the grounded feet.
    """
    needed = model.inverse_dynamics(q, v, acceleration)
    rows = model.positions(q)[1][list(feet)].reshape(-1, len(needed))
    return StanceLoad(
        feet=tuple(feet), base_rows=rows[:, :6], joint_rows=rows[:, 6:], wrench=needed[:6],
        free_torque=needed[6:], normal=model.normal, mu=model.ground.mu,
        effort=np.asarray(model.robot.effort_limit, dtype=float),
    )  # fmt: skip


# A split for locked joints: feet on non-linear springs K d^n (HC15), the robot at rest.

MAX_NEWTON_STEPS = 100
"""Newton steps before there is taken to be no rest."""

REST_IMBALANCE = 1e-12
"""Imbalance over the largest load at which the robot is at rest [-]."""

MIN_STEP_SHARE = 1e-12
"""Smallest share of a Newton step that is tried [-]."""


class NoRestError(HexapodError):
    """The springs find no rest: the robot tips over, or is not pressed on the ground."""


@dataclass(frozen=True)
class ContactSprings:
    """The forces at rest with locked joints, small displacements, springs that only push.

    Attributes:
        stiffness: K of the normal force K d^n [N/m^n].
        exponent: n [-].
        tangential: linear stiffness within the ground [N/m].
        label: its name in reports.
    """

    stiffness: float
    exponent: float = 1.5
    tangential: float = 2e4
    label: str = "contact springs"

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ParameterError: a stiffness is not positive, or the exponent below 1.
        """
        for name in ("stiffness", "tangential"):
            if not getattr(self, name) > 0.0:
                raise ParameterError(f"ContactSprings.{name}", getattr(self, name), "above 0")
        if not self.exponent >= 1.0:
            raise ParameterError("ContactSprings.exponent", self.exponent, "at least 1")

    def share(self, load: StanceLoad) -> Array:
        """Return the forces (3k,) [N].

        Raises:
            NoRestError: there is no rest with these feet.
        """
        shift = self.displacement(load)
        return self._force(load, load.base_rows @ shift)[0]

    def displacement(self, load: StanceLoad) -> Array:
        """Return how far the base moves from where all feet just touch, body axes (6,) [m, rad].

        Newton's method on the elastic energy, which is convex; a step is halved until the
        imbalance falls.

        Raises:
            NoRestError: there is no rest with these feet.
        """
        shift = self._first_guess(load)
        scale = float(np.abs(load.wrench).max())
        for _ in range(MAX_NEWTON_STEPS):
            force, stiffness = self._force(load, load.base_rows @ shift)
            imbalance = load.imbalance(force)
            if np.abs(imbalance).max() <= REST_IMBALANCE * scale:
                return shift
            tangent = load.base_rows.T @ stiffness @ load.base_rows
            solved = np.linalg.lstsq(tangent, imbalance, rcond=1e-14)[0]
            step = np.asarray(solved, dtype=np.float64)
            share = self._step_share(load, shift, step, float(imbalance @ imbalance))
            shift = shift + share * step
        raise NoRestError(f"no rest on {len(load.feet)} feet: {np.abs(imbalance).max():.3g} N left")

    def _step_share(self, load: StanceLoad, shift: Array, step: Array, before: float) -> float:
        """Return the share of a step after which the imbalance is smaller."""
        share = 1.0
        while share > MIN_STEP_SHARE:
            force, _ = self._force(load, load.base_rows @ (shift + share * step))
            left = load.imbalance(force)
            if float(left @ left) < before:
                return share
            share *= 0.5
        return share

    def _first_guess(self, load: StanceLoad) -> Array:
        """Return the displacement in which all feet share the load evenly."""
        count = len(load.feet)
        normals = np.tile(load.normal, count)
        load_per_foot = float(np.linalg.norm(load.wrench[:3])) / count
        depth = (load_per_foot / self.stiffness) ** (1.0 / self.exponent)
        guess: Array = np.linalg.lstsq(load.base_rows, -depth * normals, rcond=None)[0]
        return guess

    def _force(self, load: StanceLoad, shift: Array) -> tuple[Array, Array]:
        """Return forces (3k,) and -df/dshift (3k, 3k) for displacements of the contact points."""
        from scipy.linalg import block_diag

        count = len(load.feet)
        place = shift.reshape(count, 3)
        depth = np.maximum(-place @ load.normal, 0.0)
        flat = place + np.outer(-place @ load.normal, load.normal)
        normal_force = self.stiffness * depth**self.exponent
        touching = (depth > 0.0).astype(float)
        force = normal_force[:, None] * load.normal
        force -= (self.tangential * touching)[:, None] * flat
        slope = self.exponent * self.stiffness * depth ** (self.exponent - 1.0) * touching
        along = np.outer(load.normal, load.normal)
        blocks = [
            s * along + self.tangential * t * (np.eye(3) - along)
            for s, t in zip(slope, touching, strict=True)
        ]
        return force.ravel(), np.asarray(block_diag(*blocks))
