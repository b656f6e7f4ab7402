"""Geometry of one leg: foot position and Jacobian for any sign and zero convention.

Everything is read from the robot's model at q = 0. Angles in rad, lengths in m, base axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ReachError
from hexapod_pin.robot.serial_chain import SerialChain
from hexapod_pin.robot.yaw_pitch_pitch import YawPitchPitch

POSITION_TOLERANCE = 1e-9
"""A foot is on the yaw axis, or a numerical solution found, within this distance [m]."""

ANGLE_TOLERANCE = 1e-9
"""A joint angle is outside its limits when it is beyond them by more than this [rad]."""


@dataclass(frozen=True)
class LegGeometry:
    """One leg of a robot, base frame, joints proximal first.

    Attributes:
        name: the leg's name.
        joints: joint names. Three.
        axes: unit joint axes at q = 0, base axes. Shape (3, 3), one row per joint.
        origins: joint origins at q = 0, base frame [m]. Shape (3, 3).
        foot: foot centre at q = 0, base frame [m]. Shape (3,).
        lower: lower joint limits [rad]. Shape (3,).
        upper: upper joint limits [rad]. Shape (3,).
        posture: joint angles of the robot's standing posture [rad]. Shape (3,).
        closed_form: the yaw-pitch-pitch geometry, or None for a leg of another shape.
    """

    name: str
    joints: tuple[str, str, str]
    axes: Array
    origins: Array
    foot: Array
    lower: Array
    upper: Array
    posture: Array
    closed_form: YawPitchPitch | None

    @cached_property
    def chain(self) -> SerialChain:
        """The leg as a serial chain."""
        return SerialChain.of(self.axes, self.origins, self.foot)

    def forward(self, q: ArrayLike) -> Array:
        """Return the foot centre in the base frame [m].

        Args:
            q: joint angles [rad]. Shape (..., 3).

        Returns:
            p_BF. Shape (..., 3).
        """
        return self.chain.forward(np.asarray(q, dtype=float))

    def jacobian(self, q: ArrayLike) -> Array:
        """Return d p_BF / d q [m/rad], base axes.

        Args:
            q: joint angles [rad]. Shape (..., 3).

        Returns:
            One column per joint. Shape (..., 3, 3).
        """
        return self.chain.jacobian(np.asarray(q, dtype=float))

    def check_limits(self, q: Array) -> None:
        """Refuse joint angles (N, 3) beyond the joint limits.

        Raises:
            ReachError: naming the joint that crosses its limit most.
        """
        beyond = np.maximum(self.lower - q, q - self.upper)
        row, joint = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
        if beyond[row, joint] > ANGLE_TOLERANCE:
            raise ReachError(
                self.name,
                f"joint {self.joints[joint]} would need {q[row, joint]:.4f} rad; its limits are "
                f"{self.lower[joint]:.4f} to {self.upper[joint]:.4f} rad.",
            )


def point_text(point: Array) -> str:
    """Return a point with a tenth of a millimetre."""
    return "(" + ", ".join(f"{c:.4f}" for c in point) + ")"
