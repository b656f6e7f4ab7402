"""The equations of motion where joints are prescribed: six of the base, and the joints' reactions.

With the accelerations a_j of the joints given, M_bb a_b = -(b_b + M_bj a_j) + (feet and pushes)
gives the base's, and the joints' rows of the same equations give the torques that the motion takes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from oracles.second_rhs.right_hand_side import Evaluation, Modes, RightHandSide

if TYPE_CHECKING:
    from hexapod_pin.scene.scene import Scene


class PrescribedSide(RightHandSide):
    """As `RightHandSide`; joints accelerate as `set_points` does, and `holding` is all torque."""

    def __init__(self, scene: Scene) -> None:
        """Read the scene; servos, limits and stops do not act.

        Raises:
            ParameterError: a joint with friction of its own, which is not written here.
        """
        super().__init__(scene)
        rubbing = self.drives.dry * 1.0
        for name, values in (("damping", self.drives.viscous), ("friction", rubbing)):
            if values.any():
                raise ParameterError(f"Robot.{name}", values.max(), "0 where joints are prescribed")
        self.drives.lose(list(range(len(self.drives.kp))))
        self.drives.stop_stiffness = np.zeros_like(self.drives.stop_stiffness)

    def joint_motion(
        self, time: float, q: Array, v: Array, modes: Modes
    ) -> tuple[Array, tuple[Array, Array, Array, Array], Array]:
        """Return v', (angles, rates, no torques of servos, no others), and the reactions [N m]."""
        acceleration, torque = self.bodies.driven(q, v, self.set_points(time)[2])
        none = np.zeros_like(torque)
        return acceleration, (q[7:], v[6:], none, none), torque


class TorquePeaks:
    """The largest absolute torque of each joint at the steps of a run from a time on.

    Attributes:
        since: [s].
        peak: [N m]. Shape (n,).
        time: of each peak [s]. Shape (n,).
    """

    def __init__(self, joints: int, since: float = 0.0) -> None:
        """Begin with no torque."""
        self.since, self.peak, self.time = since, np.zeros(joints), np.zeros(joints)

    def __call__(self, time: float, at: Evaluation) -> None:
        """Look at an accepted step."""
        if time < self.since:
            return
        larger = np.abs(at.holding) > self.peak
        self.peak = np.where(larger, np.abs(at.holding), self.peak)
        self.time = np.where(larger, time, self.time)
