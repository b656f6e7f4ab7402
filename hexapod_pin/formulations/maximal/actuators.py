"""Torques along the joint axes: servos, viscous damping, stops; moments between two bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.servo import servo_torque

if TYPE_CHECKING:
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
