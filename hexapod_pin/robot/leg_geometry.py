"""Geometry of one leg: foot position and Jacobian for any sign and zero convention.

Everything is read from the robot's model with walking joints at zero and held joints at the places
where they are held. Angles in rad, lengths in m, base axes.

A leg of three joints follows a foot path in space. A leg of two joints follows two components of
it: height, and travel along one horizontal direction; its foot then scrubs in the third.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ReachError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.serial_chain import SerialChain
from hexapod_pin.robot.yaw_pitch_pitch import YawPitchPitch

POSITION_TOLERANCE = 1e-9
"""A foot is on the yaw axis, or a numerical solution found, within this distance [m]."""

ANGLE_TOLERANCE = 1e-9
"""A joint angle is outside its limits when it is beyond them by more than this [rad]."""


@dataclass(frozen=True)
class LegGeometry(Immutable):
    """One leg of a robot, base frame, joints proximal first.

    Attributes:
        name: the leg's name.
        joints: names of the J joints it walks with. Two or three.
        axes: unit joint axes at q = 0, base axes. Shape (J, 3), one row per joint.
        origins: joint origins at q = 0, base frame [m]. Shape (J, 3).
        foot: foot centre at q = 0, base frame [m]. Shape (3,).
        lower: lower joint limits [rad]. Shape (J,).
        upper: upper joint limits [rad]. Shape (J,).
        posture: joint angles of the robot's standing posture [rad]. Shape (J,).
        closed_form: the yaw-pitch-pitch geometry, or None for a leg of another shape.
        task: directions in base axes along which the foot follows its path, for a leg of two
            joints: travel and height. None: all three. Shape (2, 3).
    """

    name: str
    joints: tuple[str, ...]
    axes: Array
    origins: Array
    foot: Array
    lower: Array
    upper: Array
    posture: Array
    closed_form: YawPitchPitch | None
    task: Array | None = None

    @cached_property
    def chain(self) -> SerialChain:
        """The leg as a serial chain."""
        return SerialChain.of(self.axes, self.origins, self.foot)

    def forward(self, q: ArrayLike) -> Array:
        """Return the foot centre in the base frame [m].

        Args:
            q: joint angles [rad]. Shape (..., J).

        Returns:
            p_BF. Shape (..., 3).
        """
        return self.chain.forward(np.asarray(q, dtype=float))

    def jacobian(self, q: ArrayLike) -> Array:
        """Return d p_BF / d q [m/rad], base axes.

        Args:
            q: joint angles [rad]. Shape (..., J).

        Returns:
            One column per joint. Shape (..., 3, J).
        """
        return self.chain.jacobian(np.asarray(q, dtype=float))

    def followed(self, vectors: Array) -> Array:
        """Return the components of vectors (..., 3) that the foot can follow. Shape (..., J)."""
        return vectors if self.task is None else vectors @ self.task.T

    def check_limits(self, q: Array) -> None:
        """Refuse joint angles (N, J) beyond the joint limits.

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


def travel_and_height(direction: ArrayLike) -> Array:
    """Return the `task` of a leg of two joints that travels along a horizontal direction.

    Args:
        direction: in base axes, any length but zero; its vertical part counts for nothing. (3,).
    """
    x, y, _ = np.asarray(direction, dtype=float)
    length = np.hypot(x, y)
    return read_only([[x / length, y / length, 0.0], [0.0, 0.0, 1.0]])


def point_text(point: Array) -> str:
    """Return a point with a tenth of a millimetre."""
    return "(" + ", ".join(f"{c:.4f}" for c in point) + ")"
