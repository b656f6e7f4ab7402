"""A maximal model has actuators, a constraint of its root, and Baumgarte's stabilisation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydantic import NonNegativeFloat

from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.servo import servo_torque
from hexapod_pin.robot.rotations import skew
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies


@dataclass(frozen=True, eq=False)
class JointActuators:
    """What acts at nj joints; arrays have shape (nj,).

    Attributes:
        kp: of the servos [N m/rad].
        kd: [N m s/rad].
        limit: largest servo torque [N m], may be infinite.
        damping: of the joint itself [N m s/rad].
        lower: where the stops begin [rad], may be infinite.
        upper: [rad].
        stop_stiffness: K [N m/rad]; 0: no stops.
        stop_dissipation: a [s/rad].
    """

    kp: Array
    kd: Array
    limit: Array
    damping: Array
    lower: Array
    upper: Array
    stop_stiffness: float = 0.0
    stop_dissipation: float = 0.0

    @classmethod
    def uniform(
        cls, bodies: Bodies, *, kp: ArrayLike = 0.0, kd: ArrayLike = 0.0, limited: bool = True,
        stop_stiffness: float = 0.0, stop_dissipation: float = 0.0,
    ) -> JointActuators:  # fmt: skip
        """Return the same gains at every joint, limits and damping from the URDF.

        Args:
            bodies: the bodies.
            kp: one for all or (nj,) [N m/rad], not negative.
            kd: [N m s/rad].
            limited: whether the URDF's effort limits the servos.
            stop_stiffness: K beyond the URDF's limits [N m/rad]; 0 for none.
            stop_dissipation: a [s/rad].

        Raises:
            ParameterError: a number is negative or not finite.
        """
        given = dict(kp=kp, kd=kd, stop_stiffness=stop_stiffness, stop_dissipation=stop_dissipation)
        for name, value in given.items():
            if not (np.isfinite(value).all() and (np.asarray(value) >= 0.0).all()):
                raise ParameterError(f"JointActuators.{name}", value, "finite and not negative")
        n = len(bodies.joint_names)
        limit = bodies.effort if limited else np.full(n, np.inf)
        return cls(
            np.full(n, kp), np.full(n, kd), limit, bodies.damping, bodies.lower, bodies.upper,
            float(stop_stiffness), float(stop_dissipation),
        )  # fmt: skip

    def servo_torque(self, angle: Array, rate: Array, wanted: Array, wanted_rate: Array) -> Array:
        """Return the limited PD torque (nj,) [N m]."""
        return servo_torque(
            wanted - angle, wanted_rate - rate, kp=self.kp, kd=self.kd, limit=self.limit
        )

    def passive_torque(self, angle: Array, rate: Array) -> Array:
        """Return damping and stops (nj,) [N m]: -c q' - K d max(0, 1 + 1.5 a d'), d beyond."""
        torque = -self.damping * rate
        if self.stop_stiffness > 0.0:
            beyond = np.maximum(angle - self.upper, 0.0) + np.minimum(angle - self.lower, 0.0)
            factor = 1.0 + 1.5 * self.stop_dissipation * np.sign(beyond) * rate
            torque = torque - self.stop_stiffness * beyond * np.maximum(factor, 0.0)
        return np.asarray(torque)


# Constraints between the root body and the world: none, all six, or one point held.

POINT_ROWS = 3
"""Rows that hold one point."""


@dataclass(frozen=True, eq=False)
class RootEquations:
    """The root's h constraints at one state.

    Attributes:
        violation: Phi [m]; a fixed root has no velocity and never leaves its place. Shape (h,).
        rate: Phi' [m/s, rad/s]. Shape (h,).
        rows: D. Shape (h, 6).
        gamma: [m/s^2]. Shape (h,).
    """

    violation: Array
    rate: Array
    rows: Array
    gamma: Array


@dataclass(frozen=True)
class RootConstraint:
    """How the root is held: h = 0 (free), 3 (a point held) or 6 (fixed) rows.

    Attributes:
        size: h.
        point: the held point in the root link's frame [m].
        anchor: where it is held, world [m].
    """

    size: int = 0
    point: tuple[float, ...] = (0.0, 0.0, 0.0)
    anchor: tuple[float, ...] = (0.0, 0.0, 0.0)

    @classmethod
    def free(cls) -> RootConstraint:
        """A floating root."""
        return cls()

    @classmethod
    def fixed(cls) -> RootConstraint:
        """A root that stays where it starts, at rest."""
        return cls(6)

    @classmethod
    def spherical(cls, point: Sequence[float], anchor: Sequence[float]) -> RootConstraint:
        """A root that turns: `point` in the root link's frame stays at `anchor`, world [m]."""
        return cls(POINT_ROWS, tuple(map(float, point)), tuple(map(float, anchor)))

    def equations(self, centre: Array, arm: Array, velocity: Array) -> RootEquations:
        """Return the constraints.

        Args:
            centre: of mass of the root, world [m]. Shape (3,).
            arm: from there to the point, world axes [m]. Shape (3,).
            velocity: of the root [m/s, rad/s], world axes. Shape (6,).
        """
        if self.size == POINT_ROWS:
            rows = np.concatenate([np.eye(3), -skew(arm)], axis=1)
            violation = centre + arm - np.array(self.anchor)
            gamma = -np.cross(velocity[3:], np.cross(velocity[3:], arm))
            return RootEquations(violation, rows @ velocity, rows, np.asarray(gamma))
        rows, none = np.eye(6)[: self.size], np.zeros(self.size)
        return RootEquations(none, rows @ velocity, rows, none)


# Baumgarte's stabilisation of S1 eq. 1: gamma becomes gamma - 2 alpha Phi' - beta^2 Phi.


class Baumgarte(Spec):
    """What closes drifted joints again: Phi'' + 2 alpha Phi' + beta^2 Phi = 0 (S1).

    With alpha = beta both roots lie at -alpha: an explicit step h is stable for h alpha < 2 (Euler)
    or 2.78 (RK4). Methods with inner stages lose order to large terms: see docs/formulations.md.

    Attributes:
        alpha: [1/s].
        beta: [1/s].
    """

    alpha: NonNegativeFloat = 0.0
    beta: NonNegativeFloat = 0.0

    @classmethod
    def off(cls) -> Baumgarte:
        """No terms: position errors grow with t^2."""
        return cls()

    @classmethod
    def constant(cls) -> Baumgarte:
        """The usual constant, alpha = beta = 5 1/s, critically damped (Nikravesh; Flores)."""
        return cls(alpha=5.0, beta=5.0)

    @classmethod
    def critical(cls, rate: float) -> Baumgarte:
        """Any critically damped pair, alpha = beta = rate [1/s]."""
        return cls(alpha=rate, beta=rate)

    @classmethod
    def by_step(cls, step: float) -> Baumgarte:
        """From the step h [s]: alpha = 1/h, beta = sqrt(2)/h (Flores et al. 2011).

        The pair that cancels Phi at t + h in a second-order Taylor series. For methods that
        evaluate once a step: RK4's stages turn it into an error of order 2.

        Raises:
            ParameterError: the step is not positive and finite.
        """
        if not (math.isfinite(step) and step > 0.0):
            raise ParameterError("step", step, "positive and finite [s]")
        return cls(alpha=1.0 / step, beta=math.sqrt(2.0) / step)

    def right_side(self, gamma: Array, rate: Array, violation: Array) -> Array:
        """Return gamma - 2 alpha Phi' - beta^2 Phi, the right side of D v' in S1 eq. 1."""
        return gamma - 2.0 * self.alpha * rate - self.beta**2 * violation
